// An accepted call, with everything that must survive a restart of the gateway.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {

/// One attempt: the instance that it was dispatched to.
struct Attempt {
  fabric::InstanceId instance;
  std::uint32_t number = 1;
  bool operator==(const Attempt&) const = default;
};

/// The dispatcher's decision for the call.
struct Assignment {
  Attempt attempt;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  /// For people: "square_root on host7". Shared, since each dispatched call has it.
  std::shared_ptr<const std::string> name;
  /// Neither its instance nor any other has room: it waits there for its turn.
  bool waits = false;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;

  [[nodiscard]] std::string_view instance_name() const { return name ? *name : std::string_view(); }
};

struct CallRecord {
  fabric::CallId id{};
  fabric::ChannelKey key{};
  PendingRequest request{};
  fabric::Time seen{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  /// The variable that its NC program waits for, as announced by the instance of the last dispatch.
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  /// In order; an answer to any of them is an answer to the call.
  std::vector<Attempt> attempts{};
  /// Interim states that the channel may show.
  std::vector<std::uint32_t> shown{};
  std::optional<Answer> answer{};
  /// The journal has the entry that REQUEST_STATE is being cleared.
  bool clearing = false;
  bool operator==(const CallRecord&) const = default;

  /// The entry that opens it in the journal with its first attempt, or adds one.
  [[nodiscard]] DispatchedEntry dispatched(const Attempt& attempt) const {
    return {id, key, request, seen, delivery, attempt.number, attempt.instance, completion_signal};
  }
  [[nodiscard]] bool asked(const fabric::InstanceId& instance) const {
    return std::ranges::any_of(
        attempts, [&](const Attempt& attempt) { return attempt.instance == instance; });
  }
};

}  // namespace millrace::gateway
