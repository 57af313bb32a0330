#include "services/archiver/retention.hpp"

#include <numeric>

namespace millrace::services::archiver {

bool must_rotate(const Policy& policy, fabric::Time begun, std::uintmax_t bytes, fabric::Time now) {
  const bool too_large = policy.rotate_bytes != 0 && bytes >= policy.rotate_bytes;
  const bool too_old = policy.rotate_age.count() != 0 &&
                       (now - begun >= policy.rotate_age || begun - now > policy.rotate_age);
  return too_large || too_old;
}

std::size_t expired(const Policy& policy, const std::vector<Closed>& closed,
                    std::uintmax_t open_bytes, fabric::Time now) {
  std::uintmax_t total =
      std::accumulate(closed.begin(), closed.end(), open_bytes,
                      [](std::uintmax_t sum, const Closed& file) { return sum + file.bytes; });
  std::size_t count = 0;
  while (count + 1 < closed.size()) {
    const Closed& oldest = closed[count];
    const bool too_old =
        policy.keep_age.count() != 0 && oldest.ended && now - *oldest.ended >= policy.keep_age;
    const bool too_large = policy.keep_bytes != 0 && total > policy.keep_bytes;
    if (!too_old && !too_large) {
      break;
    }
    total -= oldest.bytes;
    ++count;
  }
  return count;
}

}  // namespace millrace::services::archiver
