// The replies for a requester: of any writer and kind, limited to the keys of its own requests.
//
//   ForeignReplies replies(participant, "millrace/*", {.listener = listener.get()});
//   replies.ask(key_of(request));                  // before it is published
//   for (const Taken<Reply>& taken : replies.take()) …
//
// A Reader<Reply> drops a reply of an unknown kind without a report, and its call would wait for
// ever.
#pragma once

#include <cstdint>
#include <memory>
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
  ~ForeignReplies();
  ForeignReplies(const ForeignReplies&) = delete;
  ForeignReplies& operator=(const ForeignReplies&) = delete;

  /// Takes replies to this, however many others there are.
  void ask(const RequestKey& key);
  /// Up to 64; call it until it returns none. A reply of an unknown kind or code has unknown_kind.
  std::vector<Taken<Reply>> take();
  /// Number of replies that were dropped because of too many keys.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  struct Type;

  std::unique_ptr<Type> type_;
  mutable std::mutex lock_;
  ReplyKeys keys_;
  dds::Entity topic_;
  dds::Entity subscriber_;
  dds::Entity reader_;
};

}  // namespace millrace::fabric::wire
