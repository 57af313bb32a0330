#include "fabric/trust/participant.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::fabric::trust {

namespace {

constexpr std::array<std::pair<Role, std::string_view>, 5> names{{{Role::gateway, "gateway"},
                                                                  {Role::service, "service"},
                                                                  {Role::operating, "operator"},
                                                                  {Role::observer, "observer"},
                                                                  {Role::tester, "tester"}}};

/// The limit of X.509 for a common name.
constexpr std::size_t max_name = 64;
/// The limit of the wire for them.
constexpr std::size_t max_identifier = 127;

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// Those that mean something in partitions or in permissions.
bool is_plain(std::string_view text, std::size_t most) {
  return !text.empty() && text.size() <= most &&
         text.find_first_of("*?[]\\,/") == std::string_view::npos &&
         std::ranges::all_of(text, [](char c) {
           constexpr unsigned char first_printable = 0x20;
           constexpr unsigned char del = 0x7f;
           const auto byte = static_cast<unsigned char>(c);
           return byte >= first_printable && byte < del;
         });
}

}  // namespace

std::string_view name_of(Role role) {
  return std::ranges::find(names, role, &std::pair<Role, std::string_view>::first)->second;
}

std::optional<Role> role_named(std::string_view name) {
  const auto* const found =
      std::ranges::find(names, name, &std::pair<Role, std::string_view>::second);
  return found == names.end() ? std::nullopt : std::optional(found->first);
}

bool is_participant_name(std::string_view name) {
  return !name.empty() && name.size() <= max_name && is_letter_or_digit(name.front()) &&
         std::ranges::all_of(name, [](char c) {
           return is_letter_or_digit(c) || c == '-' || c == '_' || c == '.';
         });
}

std::optional<std::string> mistake_in(const Participant& participant) {
  if (!is_participant_name(participant.name)) {
    return fmt::format(
        "\"{}\" is not a participant name: expected letters, digits,    ,     and    , beginning "
        "with a letter or digit, at most {} of them",
        base::text::safe(participant.name), max_name);
  }
  if (participant.roles.empty()) {
    return "no role; expected gateway, service, operator, observer or tester";
  }
  if (participant.roles.contains(Role::service) == participant.uuids.empty()) {
    return participant.uuids.empty() ? "a service needs the UUIDs that it may answer"
                                     : "UUIDs are for the role service";
  }
  if (participant.roles.contains(Role::gateway) == participant.machines.empty()) {
    return participant.machines.empty() ? "a gateway needs the names of its machines"
                                        : "machines are for the role gateway";
  }
  for (const std::string& uuid : participant.uuids) {
    if (!is_plain(uuid, max_identifier)) {
      return fmt::format(
          "\"{}\" cannot be a UUID in a certificate: expected at most {} printable characters of "
          "ASCII without    ,    ,    ,    ,     ,     and    ",
          base::text::safe(uuid), max_identifier);
    }
  }
  for (const std::string& machine : participant.machines) {
    if (!is_machine_name(machine)) {
      return fmt::format(
          "\"{}\" is not a machine name: expected letters, digits,     and     of ASCII, at most "
          "{} of them, as the gateway's configuration has it",
          base::text::safe(machine), longest_machine_name);
    }
  }
  return std::nullopt;
}

}  // namespace millrace::fabric::trust
