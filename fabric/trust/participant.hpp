// A participant of a fabric with trust, and its roles. Pure.
//
//   const Participant participant{.name = "square-root", .roles = {Role::service}, .uuids = {"560aacbf-…"}};
//   if (auto mistake = mistake_in(participant)) …
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::fabric::trust {

enum class Role : std::uint8_t {
  /// Dispatches the calls of machines to services: writes requests, the state of its machines, and
  /// commands.
  gateway,
  /// Answers the calls of its UUIDs, and reads no others.
  service,
  /// Reads everything; answers, retries, drains.
  operating,
  /// Sees everything, and writes only its own alarms: a recorder, a status page.
  observer,
  /// Reads everything and sends requests for invented machines: `millrace call` and `millrace
  /// replay`.
  tester
};

/// "gateway", "service", "operator", "observer", "tester".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);

struct Participant {
  /// Of letters, digits, '-', '_' and '.', beginning with a letter or digit; at most 64.
  std::string name;
  std::set<Role> roles{};
  /// Of a service; as NC programs write them, compared in canonical form.
  std::vector<std::string> uuids{};
  /// Of a gateway: the names of its machines.
  std::vector<std::string> machines{};
};

/// A name that is also one of a folder: see Participant::name.
bool is_participant_name(std::string_view name);

/// The mistake in a participant, for its author: a service without a UUID, a UUID with a wildcard …
std::optional<std::string> mistake_in(const Participant& participant);

}  // namespace millrace::fabric::trust
