// How a gateway publishes the numbers of a message queue: as machine data, in the group of this
// name under the queue's own key, "press.alarms/1". Its values: last_filled, last_get and elements
// of the controller's structure and array; messages read, answered and waiting, from the journal;
// response and response_state of the last message; array, uuid and drain, as configured.
//
//   if (is_queue(sample)) {
//     if (const auto filled = filled_of(sample)) …          // 3 messages of 99 that have room
//   }
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "fabric/data.hpp"

namespace millrace::fabric {

inline constexpr std::string_view queue_group = "queue";

/// The sample comes from another process and may be incomplete.
[[nodiscard]] bool is_queue(const DataSample& sample);
/// Null if there is none of this name.
[[nodiscard]] const Value* value_of(const DataSample& sample, std::string_view name);
/// The last value from the controller or the gateway, of any quality.
[[nodiscard]] std::optional<std::int64_t> number_of(const DataSample& sample,
                                                    std::string_view name);

/// Messages that stand in the controller, and that have room there.
struct Filled {
  std::int64_t messages = 0;
  std::int64_t room = 0;
};
/// Nothing before the first look.
[[nodiscard]] std::optional<Filled> filled_of(const DataSample& sample);

}  // namespace millrace::fabric
