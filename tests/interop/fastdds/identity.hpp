// The identity of an instance, as in docs/reference/wire.md: ids, and the text in the user_data of
// its endpoints.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::tests::interop::fastdds {

/// The 16 bytes of a UUID.
using Id = std::array<std::uint8_t, 16>;

/// A random UUID of version 4.
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
  /// Number of calls at once.
  std::uint32_t concurrency = 1;
  bool draining = false;
  std::uint32_t lease_ms = 500;
};

/// For the user_data of the request reader.
std::string reader_data(const Identity& identity);
/// For the user_data of the reply writer.
std::string writer_data(const Id& instance);
/// The parts of a request reader's user_data that a caller needs: id and UUID; nothing if it is not
/// an instance's.
std::optional<Identity> parse_reader_data(std::string_view text);

}  // namespace millrace::tests::interop::fastdds
