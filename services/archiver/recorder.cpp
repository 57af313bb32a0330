#include "services/archiver/recorder.hpp"

#include <optional>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>

#include "fabric/dds/post_once.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::services::archiver {

namespace {

using fabric::ChannelStatus;
using fabric::Event;
using fabric::wire::Reader;
using fabric::wire::Taken;

template <typename Value>
std::unique_ptr<Reader<Value>> open(const fabric::dds::Participant& participant,
                                    fabric::dds::PostOnce& post) {
  const fabric::dds::Listener listener(dds_create_listener(nullptr));
  post.listen_for_data(listener.get());
  return std::make_unique<Reader<Value>>(participant, participant.options().fabric,
                                         fabric::wire::Keep::all,
                                         fabric::wire::EndpointOptions{.listener = listener.get()});
}

/// Takes all there is and hands each value to `use`.
template <typename Value, typename Use>
void drain(Reader<Value>& reader, Use use) {
  for (auto batch = reader.take(); !batch.empty(); batch = reader.take()) {
    for (Taken<Value>& taken : batch) {
      if (taken.valid) {
        use(std::move(taken.value));
      }
    }
  }
}

}  // namespace

struct Recorder::Impl : std::enable_shared_from_this<Impl> {
  Impl(const fabric::dds::ParticipantOptions& join, RecorderOptions wanted,
       std::function<void(Row)> destination)
      : options(std::move(wanted)), sink(std::move(destination)), participant(join) {}

  void open_readers() {
    post.emplace(context.get_executor(), weak_from_this(), [this] { take(); });
    if (options.events) {
      events = open<Event>(participant, *post);
    }
    if (options.channels) {
      channels = open<ChannelStatus>(participant, *post);
    }
    thread = std::thread([this] { context.run(); });
  }

  void close() {
    context.stop();
    thread.join();
    events.reset();
    channels.reset();
  }

  void take() {
    if (events) {
      drain(*events, [this](Event event) {
        const bool secret = options.without_text.contains(fabric::canonical_uuid(event.uuid));
        sink(EventRow{.event = std::move(event), .with_text = !secret});
      });
    }
    if (channels) {
      drain(*channels, [this](ChannelStatus status) { sink(std::move(status)); });
    }
  }

  RecorderOptions options;
  std::function<void(Row)> sink;
  fabric::dds::Participant participant;
  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  // Before the readers that wake it.
  std::optional<fabric::dds::PostOnce> post;
  std::unique_ptr<Reader<Event>> events;
  std::unique_ptr<Reader<ChannelStatus>> channels;
  std::thread thread;
};

Recorder::Recorder(const fabric::dds::ParticipantOptions& join, RecorderOptions options,
                   std::function<void(Row)> sink)
    : impl_(std::make_shared<Impl>(join, std::move(options), std::move(sink))) {
  impl_->open_readers();
}

Recorder::~Recorder() {
  impl_->close();
}

}  // namespace millrace::services::archiver
