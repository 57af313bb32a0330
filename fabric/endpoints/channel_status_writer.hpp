// Publishes the status of each channel.
//
//   ChannelStatusWriter status_writer(participant, [&] { post.post(); });   // which calls status_writer.update_readers()
//   status_writer.write(status);
//
// While there is no reader, a change is stored and not written: a call changes the status of its
// channel five times, and each write costs Cyclone 2 us. A new reader gets the status at once, as
// from Cyclone itself. Writes wait for flush(), so that the status samples of a turn share
// datagrams.
#pragma once

#include <functional>
#include <string>
#include <unordered_map>

#include "fabric/dds/reader_count.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

/// For one thread, except `changed`, which is called in a thread of Cyclone.
class ChannelStatusWriter {
 public:
  /// `changed` must make update_readers() run soon.
  ChannelStatusWriter(const dds::Participant& participant, const std::string& partition,
                      std::function<void()> changed)
      : readers_(std::move(changed)),
        writer_(participant, partition, {.listener = listener().get(), .batched = true}) {}

  tl::expected<void, std::string> write(const ChannelStatus& status) {
    if (has_readers_) {
      return writer_.write(status);
    }
    unwritten_.insert_or_assign(status.key, status);
    return {};
  }

  /// The channel is not ours any more.
  void unregister(const ChannelKey& key) {
    unwritten_.erase(key);
    writer_.unregister(ChannelStatus{.key = key});
  }

  /// Sends what was written.
  void flush() { writer_.flush(); }

  /// There is a reader, as of the last update_readers().
  [[nodiscard]] bool has_readers() const { return has_readers_; }

  /// Readers have come or gone.
  void update_readers() {
    has_readers_ = readers_.present();
    if (has_readers_) {
      for (const auto& [key, status] : unwritten_) {
        writer_.write(status);
      }
      unwritten_.clear();
      flush();
    }
  }

 private:
  dds::Listener listener() {
    dds::Listener made(dds_create_listener(nullptr));
    readers_.listen(made.get());
    return made;
  }

  dds::ReaderCount readers_;
  wire::Writer<ChannelStatus> writer_;
  bool has_readers_ = false;
  std::unordered_map<ChannelKey, ChannelStatus, ChannelKeyHash> unwritten_;
};

}  // namespace millrace::fabric::endpoints
