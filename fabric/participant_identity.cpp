#include "fabric/participant_identity.hpp"

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::fabric {

namespace {

constexpr std::string_view of_name = "name/";
constexpr std::string_view of_role = "role/";
constexpr std::string_view of_machine = "machine/";
constexpr std::string_view tester = "tester";

std::string prefix_of(std::string_view fabric) {
  return fmt::format("{}/@", fabric);
}

/// The rest of `text` after `kind`; nullopt if it does not begin with it, or is a pattern.
std::optional<std::string> after(std::string_view text, std::string_view kind) {
  if (!text.starts_with(kind) || text.size() == kind.size() ||
      text.find_first_of("*?") != std::string_view::npos) {
    return std::nullopt;
  }
  return std::string(text.substr(kind.size()));
}

}  // namespace

std::vector<std::string> identity_partitions(std::string_view fabric,
                                             const ParticipantIdentity& identity) {
  const std::string prefix = prefix_of(fabric);
  std::vector<std::string> all{fmt::format("{}{}{}", prefix, of_name, identity.name)};
  for (const std::string& role : identity.roles) {
    all.push_back(fmt::format("{}{}{}", prefix, of_role, role));
  }
  for (const std::string& machine : identity.machines) {
    all.push_back(fmt::format("{}{}{}", prefix, of_machine, machine));
  }
  return all;
}

std::string identity_readers_partition(std::string_view fabric) {
  return prefix_of(fabric) + "*";
}

std::optional<ParticipantIdentity> parse_participant_identity(
    std::string_view fabric, const std::vector<std::string>& partitions) {
  const std::string prefix = prefix_of(fabric);
  ParticipantIdentity identity;
  for (const std::string_view partition : partitions) {
    if (!partition.starts_with(prefix)) {
      continue;
    }
    const std::string_view claimed = partition.substr(prefix.size());
    if (auto name = after(claimed, of_name)) {
      if (!identity.name.empty() && identity.name != *name) {
        return std::nullopt;
      }
      identity.name = *std::move(name);
    } else if (auto role = after(claimed, of_role)) {
      identity.roles.insert(*std::move(role));
    } else if (auto machine = after(claimed, of_machine)) {
      identity.machines.insert(*std::move(machine));
    }
  }
  return identity.name.empty() ? std::nullopt : std::optional(std::move(identity));
}

std::string format_process_info(const ProcessInfo& where) {
  return fmt::format("{}\n{}\n{}\n{}", where.pid, where.host, where.program,
                     format_process_version(where.version));
}

std::optional<ProcessInfo> parse_process_info(std::string_view user_data) {
  const std::size_t first = user_data.find('\n');
  const std::size_t second =
      first == std::string_view::npos ? first : user_data.find('\n', first + 1);
  const auto pid = base::text::parse_number<std::uint32_t>(user_data.substr(0, first));
  if (second == std::string_view::npos || !pid) {
    return std::nullopt;
  }
  const std::string_view rest = user_data.substr(second + 1);
  return ProcessInfo{.program = std::string(rest.substr(0, rest.find('\n'))),
                     .host = std::string(user_data.substr(first + 1, second - first - 1)),
                     .pid = *pid,
                     .version = parse_process_version(rest).value_or(ProcessVersion{})};
}

Authorization authorization_of(const IdentityStatus& status, std::string_view machine,
                               bool testers) {
  if (status.revoked) {
    return Authorization::revoked;
  }
  if (!status.identity) {
    return Authorization::unauthenticated;
  }
  // A queue of a machine speaks as "press_1.orders".
  const bool may = machine.empty() ||
                   status.identity->machines.contains(std::string(machine_of(machine))) ||
                   (testers && status.identity->roles.contains(std::string(tester)));
  return may ? Authorization::granted : Authorization::other_machine;
}

std::string denial_of(const IdentityStatus& status, Authorization authorization,
                      std::string_view machine) {
  std::string name = status.identity ? base::text::safe(status.identity->name) : std::string();
  switch (authorization) {
    case Authorization::unauthenticated:
      return "a process that announces no identity";
    case Authorization::revoked:
      return fmt::format("the certificate of {} is revoked", name);
    case Authorization::other_machine:
      return fmt::format("{} speaks for {}, which its certificate does not name", name,
                         base::text::safe(machine));
    case Authorization::granted:
      break;
  }
  return name;
}

std::string issuer_of(const std::string& certificate, const std::string& claimed) {
  if (certificate.empty() || claimed == certificate || claimed.starts_with(certificate + " (")) {
    return claimed;
  }
  // At most 127 bytes fit.
  return fmt::format("{:.40} ({:.80})", certificate, claimed);
}

base::messages::Message time_left(std::chrono::sys_seconds until, std::chrono::sys_seconds now) {
  const auto left = until - now;
  return left < std::chrono::days(2)
             ? base::messages::hours(std::chrono::floor<std::chrono::hours>(left).count())
             : base::messages::days(std::chrono::floor<std::chrono::days>(left).count());
}

}  // namespace millrace::fabric
