// The version of a process and the wire versions that it understands, as its participant announces
// them: of two processes without a common one, which must be upgraded? Pure.
//
// The user_data of a participant. With trust, where every process can read that, it follows the
// process of an identity, which only trusted participants read:
//
//   millrace-process 1
//   version=1.0.0
//   lowest_wire=5
//   highest_wire=5
//
// A reader skips keys that it does not know, so that a later version can add some.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::fabric {

/// The wire versions that this version understands: the number in the names of all topics.
inline constexpr std::uint32_t lowest_wire_version = 5;
inline constexpr std::uint32_t highest_wire_version = 5;

struct ProcessVersion {
  /// Of millrace; empty for a process of another make.
  std::string version{};
  /// 0: unknown.
  std::uint32_t lowest_wire = 0;
  std::uint32_t highest_wire = 0;
  bool operator==(const ProcessVersion&) const = default;
};

std::string format_process_version(const ProcessVersion& process);
/// Reads foreign bytes. Nullopt if they are no announcement, or name no range of wire versions.
std::optional<ProcessVersion> parse_process_version(std::string_view user_data);

/// The wire version in the name of a topic of millrace; nullopt if it has none.
std::optional<std::uint32_t> wire_version_of(std::string_view topic);

/// `process` understands no wire version of `other`, and only later ones are used there.
bool is_too_old_for(const ProcessVersion& process, const ProcessVersion& other);

/// "5 (millrace 1.0.0)", "6-7 (millrace 2.0.0)", "5".
std::string wire_text(const ProcessVersion& process);

}  // namespace millrace::fabric
