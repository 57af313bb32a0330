// Limits of what an instance announces.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::fabric::registry {

/// Limits of what an instance announces: discovery repeats it to every process.
inline constexpr std::size_t max_identity_value = 255;
inline constexpr std::size_t max_identity_channels = 64;
/// A shorter lease would make all readers process its heartbeats and nothing else.
inline constexpr std::chrono::milliseconds min_identity_lease{50};

/// Why `identity` cannot be announced (no UUID, a wildcard in it, a value too long, concurrency 0,
/// a lease too short); empty if it can.
std::optional<std::string> check_identity(const InstanceIdentity& identity);

}  // namespace millrace::fabric::registry
