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
  /// When its certificate expires: Cyclone then removes the participant without a report.
  std::chrono::sys_seconds until{};
  /// The names on the host's present CRL, or why it cannot be read. Called about once a second, in
  /// a thread of the participant.
  std::function<tl::expected<std::set<std::string>, std::string>()> revoked{};
  /// Its own certificate has expired or was revoked; called in that thread, repeatedly until the
  /// process has ended. May be empty.
  std::function<void(const std::string& reason)> ended{};
};

}  // namespace millrace::fabric::dds
