// The cycles of this library, written in NC: cnc/nc/cycles/*.cyc.
#pragma once

#include <optional>
#include <string_view>

namespace millrace::cnc::nc {

/// The text of a cycle by its file name ("SysServiceWait.cyc", case-insensitive); nullopt if the
/// library does not have it.
[[nodiscard]] std::optional<std::string_view> shipped_cycle(std::string_view name);

}  // namespace millrace::cnc::nc
