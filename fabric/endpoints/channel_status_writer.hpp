// Publishes the status of each channel.
//
//   ChannelStatusWriter status_writer(participant, [&] { post.post(); });   // which calls status_writer.update_readers()
//   status_writer.write(status);
//   status_writer.flush();
//
// A status waits until flush(), which is called seldom, and a newer one of its channel replaces it:
// a call changes the status of its channel five times, and each write costs Cyclone 2 us.
// flush(key) is for a status that a gateway standing by must have before the next step. While there
// is no reader a status waits for one; a new reader gets it at once, as from Cyclone itself.
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

  void write(const ChannelStatus& status) { unwritten_.insert_or_assign(status.key, status); }

  /// The channel is not ours any more; its last status is written.
  void unregister(const ChannelKey& key) {
    if (const auto last = unwritten_.extract(key); has_readers_ && !last.empty()) {
      static_cast<void>(writer_.write(last.mapped()));
    }
    writer_.unregister(ChannelStatus{.key = key});
    writer_.flush();
  }

  /// Writes what waits. A status that cannot be written is lost; the next one follows it.
  void flush() {
    if (has_readers_) {
      for (const auto& [key, status] : unwritten_) {
        static_cast<void>(writer_.write(status));
      }
      unwritten_.clear();
      writer_.flush();
    }
  }

  /// Writes the status of this channel, if it waits.
  void flush(const ChannelKey& key) {
    if (!has_readers_) {
      return;
    }
    if (const auto waiting = unwritten_.extract(key); !waiting.empty()) {
      static_cast<void>(writer_.write(waiting.mapped()));
      writer_.flush();
    }
  }

  /// There is a reader, as of the last update_readers().
  [[nodiscard]] bool has_readers() const { return has_readers_; }

  /// Readers have come or gone.
  void update_readers() {
    has_readers_ = readers_.present();
    flush();
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
