#include "services/archiver/observer_thread.hpp"

#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>

#include "fabric/observer/observer.hpp"

namespace millrace::services::archiver {

struct ObserverThread::Impl final : fabric::observer::ObserverListener {
  Impl(const fabric::dds::ParticipantOptions& join, Observed what,
       std::function<void(Row)> destination)
      : wanted(std::move(what)),
        sink(std::move(destination)),
        participant(join),
        observer(participant, context.get_executor(), *this, fabric::observer::Interest::calls),
        thread([this] { context.run(); }) {}

  ~Impl() override {
    context.stop();
    thread.join();
  }

  void on_entry(fabric::observer::Entry entry) override {
    if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      if (wanted.events) {
        const bool secret = wanted.without_text.contains(entry.uuid);
        sink(EventRow{.event = std::move(*event), .with_text = !secret});
      }
    } else if (auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
      if (wanted.channels) {
        sink(std::move(*status));
      }
    }
  }

  Observed wanted;
  std::function<void(Row)> sink;
  fabric::dds::Participant participant;
  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  fabric::observer::Observer observer;
  std::thread thread;
};

ObserverThread::ObserverThread(const fabric::dds::ParticipantOptions& join, Observed wanted,
                               std::function<void(Row)> sink)
    : impl_(std::make_unique<Impl>(join, std::move(wanted), std::move(sink))) {}

ObserverThread::~ObserverThread() = default;

}  // namespace millrace::services::archiver
