// Who an instance is, as docs/reference/wire.md has it: ids, and the text that stands in the
// user_data of its endpoints.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::tests::interop::fastdds {

/// The 16 bytes of a UUID.
using Id = std::array<std::uint8_t, 16>;

/// Version 4, drawn anew.
Id random_id();
/// 36 characters, lower case.
std::string text_of(const Id& id);
std::optional<Id> parse_id(std::string_view text);

struct Identity {
  Id id{};
  std::string uuid;
  std::string name;
  /// For people, as the name.
  std::string host;
  std::uint32_t pid = 0;
  /// Calls that it takes at once.
  std::uint32_t concurrency = 1;
  bool draining = false;
  std::uint32_t lease_ms = 500;
};

/// For the user_data of the request reader.
std::string reader_data(const Identity& identity);
/// For the user_data of the reply writer.
std::string writer_data(const Id& instance);
/// What a caller needs of a request reader's user_data: id and UUID; nothing if it is no instance.
std::optional<Identity> parse_reader_data(std::string_view text);

}  // namespace millrace::tests::interop::fastdds
