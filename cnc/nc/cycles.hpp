// The cycles that come with this library, written in NC: cnc/nc/cycles/*.cyc.
#pragma once

#include <optional>
#include <string_view>

namespace millrace::cnc::nc {

/// The text of a cycle by its file name ("SysServiceWait.cyc", in any case), if it is one of ours.
[[nodiscard]] std::optional<std::string_view> shipped_cycle(std::string_view name);

}  // namespace millrace::cnc::nc
