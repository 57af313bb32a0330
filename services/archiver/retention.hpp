// Decides when a file of the archive is closed, and which closed files are removed. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::services::archiver {

/// Zero = no limit, for each of the four.
struct Policy {
  std::uintmax_t rotate_bytes = 256ULL << 20U;
  std::chrono::hours rotate_age{24};
  std::chrono::hours keep_age{365 * 24};
  std::uintmax_t keep_bytes = 10240ULL << 20U;
};

/// True if a file with this begin and size must be closed; also if it was begun by a clock that was
/// ahead by more than the maximum age of a file.
bool must_rotate(const Policy& policy, fabric::Time begun, std::uintmax_t bytes, fabric::Time now);

/// A closed file.
struct Closed {
  std::uintmax_t bytes = 0;
  /// Nullopt if unknown: then the file does not expire by age.
  std::optional<fabric::Time> ended{};
};

/// How many of `closed`, oldest first, must be removed beside an open file of `open_bytes`. The
/// newest always stays: it identifies repeated calls.
std::size_t expired(const Policy& policy, const std::vector<Closed>& closed,
                    std::uintmax_t open_bytes, fabric::Time now);

}  // namespace millrace::services::archiver
