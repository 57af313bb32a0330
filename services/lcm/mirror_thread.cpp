#include "services/lcm/mirror_thread.hpp"

#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <spdlog/spdlog.h>

#include "base/program/barrier.hpp"
#include "fabric/lcm/mirror.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/observer/observer.hpp"

namespace millrace::services::lcm {

struct MirrorThread::Impl final : fabric::observer::ObserverListener {
  Impl(fabric::dds::Participant& participant, Mirror own_mirror, Socket& own_socket,
       base::program::Log own_log)
      : mirror(std::move(own_mirror)),
        socket(own_socket),
        log(std::move(own_log)),
        observer(participant, context.get_executor(), *this,
                 fabric::observer::Interest::everything),
        thread([this] { context.run(); }) {}

  ~Impl() override {
    context.stop();
    thread.join();
  }

  void on_entry(fabric::observer::Entry entry) override {
    base::program::contain("mirroring the fabric on LCM", [&] {
      if (mirror.without_text.contains(entry.uuid)) {
        fabric::observer::withhold_text(entry);
      }
      const auto message = fabric::lcm::mirrored(entry);
      if (!message) {
        return;
      }
      const auto now = std::chrono::steady_clock::now();
      if (const auto sent = socket.publish(message->channel, message->bytes); !sent) {
        if (const auto line = log_limiter.admit("mirror", "", sent.error(), now)) {
          log->warn(*line);
        }
      }
      for (const std::string& line : log_limiter.due(now)) {
        log->warn(line);
      }
    });
  }

  const Mirror mirror;
  Socket& socket;
  const base::program::Log log;
  fabric::LogLimiter log_limiter;
  boost::asio::io_context context{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  fabric::observer::Observer observer;
  std::thread thread;
};

MirrorThread::MirrorThread(fabric::dds::Participant& participant, Mirror mirror, Socket& socket,
                           base::program::Log log)
    : impl_(std::make_unique<Impl>(participant, std::move(mirror), socket, std::move(log))) {}

MirrorThread::~MirrorThread() = default;

}  // namespace millrace::services::lcm
