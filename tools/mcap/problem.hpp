// A problem of a file, and its position.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::tools::mcap {

struct Problem {
  /// Byte of the file at which it begins.
  std::uint64_t offset = 0;
  std::string text;

  /// "at byte 4711: …"
  [[nodiscard]] std::string to_string() const {
    return "at byte " + std::to_string(offset) + ": " + text;
  }
  bool operator==(const Problem&) const = default;
};

using Problems = std::vector<Problem>;

template <typename T>
using Expected = tl::expected<T, Problem>;

inline tl::unexpected<Problem> problem(std::uint64_t offset, std::string text) {
  return tl::unexpected(Problem{offset, std::move(text)});
}

}  // namespace millrace::tools::mcap
