// The entries of the journal: one before each step of a call that must be neither lost nor repeated
// after a crash.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "fabric/messages.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {

/// Call numbers of `epoch` below `reserved` may be in use. Written a block ahead, so that a number
/// is never given twice even if the newest entries are lost with the power.
struct NumbersEntry {
  std::uint64_t epoch = 0;
  std::uint64_t reserved = 0;
  bool operator==(const NumbersEntry&) const = default;
};

/// Before an attempt is published. The first one of a call opens it.
struct DispatchedEntry {
  fabric::CallId call;
  fabric::ChannelKey key;
  PendingRequest request;
  fabric::Time seen{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  std::uint32_t attempt = 1;
  fabric::InstanceId instance;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  bool operator==(const DispatchedEntry&) const = default;
};

/// Before an interim state is written to the channel, or once one that we have not written is found
/// beside the request.
struct InterimEntry {
  fabric::CallId call;
  std::uint32_t state = 0;
  bool operator==(const InterimEntry&) const = default;
};

/// A final answer.
struct Answer {
  fabric::InstanceId instance;
  std::uint32_t attempt = 1;
  std::string text;
  std::uint32_t state = 0;
  bool operator==(const Answer&) const = default;
};

/// Before anything of a final answer is written to the channel.
struct AnsweredEntry {
  fabric::CallId call;
  Answer answer;
  bool operator==(const AnsweredEntry&) const = default;
};

/// Before REQUEST_STATE is set to 0: from here on only the last write of the answer releases the
/// program.
struct ClearingEntry {
  fabric::CallId call;
  bool operator==(const ClearingEntry&) const = default;
};

/// The call is answered, or its program has withdrawn it: nothing is left to do.
struct EndedEntry {
  fabric::CallId call;
  bool operator==(const EndedEntry&) const = default;
};

/// A message of a controller's queue was read, before LastGet shows it.
struct MessageEntry {
  /// Of the queue, not of its channel.
  fabric::ChannelKey key;
  /// Counts the messages of the queue from 1.
  std::uint64_t number = 0;
  /// Its element in the queue.
  std::uint32_t element = 0;
  std::string text;
  fabric::Time seen{};
  bool operator==(const MessageEntry&) const = default;
};

/// The message and all before it are answered: nothing is left of their calls.
struct MessageEndedEntry {
  fabric::ChannelKey key;
  std::uint64_t number = 0;
  bool operator==(const MessageEndedEntry&) const = default;
};

/// LastGet of the queue is this element; messages up to this number need not be read again.
struct LastGetEntry {
  fabric::ChannelKey key;
  std::uint32_t element = 0;
  std::uint64_t number = 0;
  bool operator==(const LastGetEntry&) const = default;
};

/// Why a channel is blocked until an operator acts, and since when: for people, who see the same
/// after a restart. Idle: it is not blocked any more.
struct BlockedEntry {
  fabric::ChannelKey key{};
  /// Unserved or held; idle otherwise.
  fabric::ChannelState state = fabric::ChannelState::idle;
  /// None where the request is left alone.
  fabric::CallId call{};
  std::string uuid{};
  fabric::Time since{};
  fabric::Message reason{};
  bool operator==(const BlockedEntry&) const = default;
};

using JournalEntry =
    std::variant<NumbersEntry, DispatchedEntry, InterimEntry, AnsweredEntry, ClearingEntry,
                 EndedEntry, MessageEntry, MessageEndedEntry, LastGetEntry, BlockedEntry>;

/// Handed over with an entry, and handed back once the entry is as safe as the journal's policy
/// promises.
struct Ticket {
  /// Who waits for the entry; for call numbers that is all channels.
  enum class Owner : std::uint8_t { none, numbers, channel, queue };

  Owner owner = Owner::none;
  fabric::ChannelKey key{};
  /// Of a channel the count of the entries of all channels; of a queue which one of this key it is.
  std::uint64_t number = 0;

  explicit operator bool() const { return owner != Owner::none; }
  bool operator==(const Ticket&) const = default;
};

}  // namespace millrace::gateway
