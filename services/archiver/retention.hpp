// When a file of the archive is closed, and which closed ones are removed. Pure.
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

/// True if the file that was `begun` then and is `bytes` large now must be closed; also if it was
/// begun by a clock that was ahead by more than such a file's time.
bool must_rotate(const Policy& policy, fabric::Time begun, std::uintmax_t bytes, fabric::Time now);

/// A closed file.
struct Closed {
  std::uintmax_t bytes = 0;
  /// Nothing if that is not known: then it is not too old.
  std::optional<fabric::Time> ended{};
};

/// How many of `closed`, in the order of age, the oldest first, must be removed beside an open file
/// of `open_bytes`. The newest stays in any case: it tells repeated calls.
std::size_t expired(const Policy& policy, const std::vector<Closed>& closed,
                    std::uintmax_t open_bytes, fabric::Time now);

}  // namespace millrace::services::archiver
