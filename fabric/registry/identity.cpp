#include "fabric/registry/identity.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/characters.hpp"

namespace millrace::fabric::registry {

std::optional<std::string> check_identity(const InstanceIdentity& identity) {
  if (identity.id == InstanceId{}) {
    return "it has no instance id";
  }
  if (identity.uuid.empty() || identity.uuid.size() > max_text ||
      identity.uuid != canonical_uuid(identity.uuid)) {
    // A stranger's UUID may have 60 KiB.
    return fmt::format("its UUID {:?} is not in canonical form, 1 to {} bytes",
                       identity.uuid.substr(0, max_text), max_text);
  }
  // Partitions are patterns: with a wildcard an instance would get the requests of other UUIDs.
  if (std::any_of(identity.uuid.begin(), identity.uuid.end(),
                  [](char c) { return base::text::is_control(c) || c == '*' || c == '?'; })) {
    return fmt::format("its UUID {:?} contains a wildcard or a control character", identity.uuid);
  }
  for (const auto* value :
       {&identity.name, &identity.description, &identity.version, &identity.host}) {
    if (value->size() > max_identity_value) {
      return fmt::format("{:?}... is longer than {} bytes", value->substr(0, 20),
                         max_identity_value);
    }
  }
  if (identity.channels.size() > max_identity_channels) {
    return fmt::format("it names {} channels, at most {} fit", identity.channels.size(),
                       max_identity_channels);
  }
  if (identity.concurrency == 0) {
    return "its concurrency is 0";
  }
  if (identity.lease != std::chrono::milliseconds(0) && identity.lease < min_identity_lease) {
    return fmt::format("its lease of {} ms is shorter than {} ms", identity.lease.count(),
                       min_identity_lease.count());
  }
  return std::nullopt;
}

}  // namespace millrace::fabric::registry
