#include "services/archiver/observer_thread.hpp"

#include <optional>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>

#include "fabric/observer/observer.hpp"

namespace millrace::services::archiver {

struct ObserverThread::Impl final : fabric::observer::ObserverListener {
  Impl(const fabric::dds::ParticipantOptions& join, Observed what,
       std::function<void(Row)> destination)
      : wanted(std::move(what)), sink(std::move(destination)), participant(join) {
    using fabric::observer::Interest;
    if (wanted.events || wanted.channels) {
      calls.emplace(participant, context.get_executor(), *this, Interest::calls);
    }
    if (wanted.data || wanted.programs) {
      data.emplace(participant, context.get_executor(), *this, Interest::data);
    }
    thread = std::thread([this] { context.run(); });
  }

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
    } else if (auto* sample = std::get_if<fabric::DataSample>(&entry.sample)) {
      if (wanted.data) {
        sink(std::move(*sample));
      }
    } else if (auto* ran = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
      if (wanted.programs) {
        sink(std::move(*ran));
      }
    }
  }

  Observed wanted;
  std::function<void(Row)> sink;
  fabric::dds::Participant participant;
  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  std::optional<fabric::observer::Observer> calls;
  std::optional<fabric::observer::Observer> data;
  std::thread thread;
};

ObserverThread::ObserverThread(const fabric::dds::ParticipantOptions& join, Observed wanted,
                               std::function<void(Row)> sink)
    : impl_(std::make_unique<Impl>(join, std::move(wanted), std::move(sink))) {}

ObserverThread::~ObserverThread() = default;

}  // namespace millrace::services::archiver
