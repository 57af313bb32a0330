// The status of each channel, for whoever looks.
//
//   ChannelBoard board(participant, [&] { post.post(); });   // which calls board.look_up()
//   board.put(status);
//
// While nobody reads, what changes is noted and not written: a call changes its channel's status
// five times, and each time costs Cyclone 2 us. Who joins is told at once, as by Cyclone itself.
// What is written waits for flush(), so that the states of a turn share datagrams.
#pragma once

#include <functional>
#include <string>
#include <unordered_map>

#include "fabric/channel_key_hash.hpp"
#include "fabric/dds/reader_count.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

/// For one thread, but for `changed`, which is called in one of Cyclone's.
class ChannelBoard {
 public:
  /// `changed` has look_up() called soon.
  ChannelBoard(const dds::Participant& participant, const std::string& partition,
               std::function<void()> changed)
      : readers_(std::move(changed)),
        writer_(participant, partition, {.listener = listener().get(), .batched = true}) {}

  tl::expected<void, std::string> put(const ChannelStatus& status) {
    if (watched_) {
      return writer_.write(status);
    }
    unsaid_.insert_or_assign(status.key, status);
    return {};
  }

  /// The channel is not ours any more.
  void let_go(const ChannelKey& key) {
    unsaid_.erase(key);
    writer_.let_go(ChannelStatus{.key = key});
  }

  /// Sends what was written.
  void flush() { writer_.flush(); }

  /// Somebody reads, as of the last look_up().
  [[nodiscard]] bool watched() const { return watched_; }

  /// Readers have come or gone.
  void look_up() {
    watched_ = readers_.present();
    if (watched_) {
      for (const auto& [key, status] : unsaid_) {
        writer_.write(status);
      }
      unsaid_.clear();
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
  bool watched_ = false;
  std::unordered_map<ChannelKey, ChannelStatus, ChannelKeyHash> unsaid_;
};

}  // namespace millrace::fabric::ends
