// The replies for a requester: of any writer and kind, limited to the keys of its own requests.
//
//   ForeignReplies replies(participant, "millrace/*", {.listener = listener.get()});
//   replies.ask(key_of(request));                  // before it is published
//   for (const Taken<Reply>& taken : replies.take()) …
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "fabric/reply_keys.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::wire {

/// Not movable: Cyclone calls it. It does not check whether a reply's writer is its instance.
class ForeignReplies {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  ForeignReplies(const dds::Participant& participant, const std::string& partition,
                 const EndpointOptions& options);
  ~ForeignReplies() = default;
  ForeignReplies(const ForeignReplies&) = delete;
  ForeignReplies& operator=(const ForeignReplies&) = delete;

  /// Takes replies to this, however many others there are.
  void ask(const RequestKey& key);
  /// Up to 64; call it until it returns none. Kind and code of a later version keep their numbers.
  std::vector<Taken<Reply>> take();
  /// Number of replies that were dropped because of too many keys.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  mutable std::mutex lock_;
  ReplyKeys keys_;
  dds::Entity topic_;
  dds::Entity subscriber_;
  dds::Entity reader_;
};

}  // namespace millrace::fabric::wire
