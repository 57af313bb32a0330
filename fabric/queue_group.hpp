// Where a gateway tells of a message queue in numbers: among machine data, as the group of this
// name of the queue's own key, "press.alarms/1". Its values: last_filled, last_get and elements of
// the controller's structure and array; messages read, answered and waiting, as the journal counts
// them; response and response_state, what the last message was answered with; array, uuid and
// drain, as configured.
#pragma once

#include <string_view>

namespace millrace::fabric {

inline constexpr std::string_view queue_group = "queue";

}  // namespace millrace::fabric
