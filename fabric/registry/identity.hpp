// Limits of what an instance announces.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

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

// The text form of an instance's identity, which discovery carries in the user_data of its request
// reader. One "key=value" line each; a control byte and '%' in a value are written %XX.
//
//   millrace-instance 2
//   id=8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11
//   uuid=560aacbf-6335-44a9-895a-8b27f3ed5e47
//   name=square_root
//   channels=cnc/1 press/*
//   delivery=at-least-once
//   concurrency=1
//   draining=no
//   lease_ms=1500
//   busy_lease_ms=500
//
// A reader skips keys it does not know, so that a later version can add some.

/// The text form of an identity that check_identity accepts.
std::string format_identity(const InstanceIdentity& identity);

/// Reads foreign bytes. The error says which line is wrong and what was expected.
tl::expected<InstanceIdentity, std::string> parse_identity(std::string_view text);

/// The user_data of a reply writer: only the instance it belongs to.
std::string format_instance(const InstanceId& id);
std::optional<InstanceId> parse_instance(std::string_view text);

}  // namespace millrace::fabric::registry
