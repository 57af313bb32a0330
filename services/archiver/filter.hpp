// Which rows of the archive somebody wants to see.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::services::archiver {

enum class Kind : std::uint8_t { put, event, channel };

/// What is not set lets everything pass.
struct Filter {
  Kind kind = Kind::put;
  std::optional<fabric::Time> since{};
  /// Not included.
  std::optional<fabric::Time> until{};
  std::optional<std::string> machine{};
  std::optional<std::uint16_t> channel{};
  /// "5f3a-17".
  std::optional<std::string> call{};
  /// Of puts only: those that have this field, and with this value if there is one.
  std::optional<std::string> key{};
  std::optional<std::string> value{};
  /// At most so many rows.
  std::optional<std::uint64_t> limit{};
};

}  // namespace millrace::services::archiver
