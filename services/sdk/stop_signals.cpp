#include "services/sdk/stop_signals.hpp"

#include <cstdlib>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <spdlog/spdlog.h>

#include "base/program/barrier.hpp"
#include "base/program/command_line.hpp"
#include "base/program/supervisor.hpp"

namespace millrace::services::sdk {

struct StopSignals::Impl {
  Impl(Service::Log own_log, const std::vector<int>& numbers)
      : log(std::move(own_log)), signals(context) {
    for (const int number : numbers) {
      signals.add(number);
    }
    signals.async_wait([this](const boost::system::error_code& error, int signal) {
      if (!error) {
        first(signal);
      }
    });
    thread = std::thread([this] {
      const auto work = boost::asio::make_work_guard(context);
      context.run();
    });
  }

  void first(int signal) {
    log->info("signal {}: leaving when the running calls are answered", signal);
    base::program::notify_supervisor("STOPPING=1");
    asked = true;
    base::program::contain("leaving on a signal", [&] {
      if (stop) {
        stop();
      }
    });
    signals.async_wait([this](const boost::system::error_code& error, int) {
      if (!error) {
        log->warn("second signal: leaving at once; the running calls go to other instances");
        std::_Exit(base::program::exit_failed);
      }
    });
  }

  Service::Log log;
  // Both only on the thread.
  std::function<void()> stop;
  bool asked = false;
  boost::asio::io_context context{1};
  boost::asio::signal_set signals;
  std::thread thread;
};

StopSignals::StopSignals(Service::Log log, const std::vector<int>& signals)
    : impl_(std::make_unique<Impl>(std::move(log), signals)) {}

StopSignals::~StopSignals() {
  impl_->context.stop();
  impl_->thread.join();
}

void StopSignals::on_stop(std::function<void()> stop) {
  boost::asio::post(impl_->context, [impl = impl_.get(), stop = std::move(stop)] {
    impl->stop = stop;
    if (impl->asked) {
      base::program::contain("leaving on a signal", impl->stop);
    }
  });
}

}  // namespace millrace::services::sdk
