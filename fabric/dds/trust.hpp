// The credentials of a participant of a fabric with trust, and how it learns of revocations. Made
// by fabric/profile from the folder that `millrace trust issue` filled.
#pragma once

#include <chrono>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::fabric::dds {

struct Trust {
  /// The name in its certificate.
  std::string name{};
  /// The partitions of its identity, which its permissions allow (fabric/participant_identity.hpp).
  std::vector<std::string> identity_partitions{};
  /// When its certificate ends: Cyclone takes the participant away then, without a word.
  std::chrono::sys_seconds until{};
  /// The names of those whose certificates have been taken back, as the host knows it now; or why
  /// that cannot be read. Called about once a second, in a thread of the participant.
  std::function<tl::expected<std::set<std::string>, std::string>()> revoked{};
  /// Its own certificate is over or taken back; called in that thread, and again and again until
  /// the program has ended. May be empty.
  std::function<void(const std::string& reason)> ended{};
};

}  // namespace millrace::fabric::dds
