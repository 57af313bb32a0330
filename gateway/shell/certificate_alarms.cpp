#include "gateway/shell/certificate_alarms.hpp"

#include <map>
#include <string>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/openssl/certificate.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::gateway::shell {

namespace {

enum class Role : std::uint8_t { self_signed, of_a_ca, ca };

/// The certificate in PEM, and the machines that it is used for.
using Uses = std::map<std::pair<Role, std::string>, std::vector<std::string>>;

Uses uses_of(const std::vector<settings::MachineSettings>& machines) {
  Uses uses;
  for (const settings::MachineSettings& machine : machines) {
    if (!machine.security) {
      continue;
    }
    if (const auto* const own = std::get_if<cnc::ads::SelfSigned>(&*machine.security)) {
      uses[{Role::self_signed, own->certificate}].push_back(machine.name);
    } else if (const auto* const shared = std::get_if<cnc::ads::SharedCa>(&*machine.security)) {
      uses[{Role::of_a_ca, shared->certificate}].push_back(machine.name);
      uses[{Role::ca, shared->ca}].push_back(machine.name);
    }
  }
  return uses;
}

/// Few enough that the expiry also fits into the alarm.
std::string names_of(const std::vector<std::string>& machines) {
  constexpr std::size_t most = 3;
  if (machines.size() <= most) {
    return fmt::format("{}", fmt::join(machines, ", "));
  }
  return fmt::format("{} and {} more", fmt::join(machines.begin(), machines.begin() + most, ", "),
                     machines.size() - most);
}

std::string advice_of(Role role) {
  switch (role) {
    case Role::self_signed:
      return "move key and certificate away, have `millrace controller add-route --self-signed` "
             "make new ones and add the route again, then reload this gateway";
    case Role::of_a_ca:
      return "issue a new certificate of the CA for this gateway, then reload the gateway";
    case Role::ca:
      return "install a new CA and certificates from it on controllers and gateway, then reload "
             "this gateway";
  }
  return {};
}

}  // namespace

std::vector<fabric::Alarm> certificate_alarms(
    const std::vector<settings::MachineSettings>& machines, std::chrono::sys_seconds now) {
  std::vector<fabric::Alarm> alarms;
  for (const auto& [use, of_machines] : uses_of(machines)) {
    const auto& [role, pem] = use;
    const auto certificate = base::openssl::Certificate::read(pem);
    if (!certificate) {
      continue;  // there is no link with it, and the reason is said there
    }
    const auto until = certificate->until();
    const bool is_over = until <= now;
    const bool fine = until - now > fabric::certificate_expires_soon;
    fabric::Alarm& alarm = alarms.emplace_back();
    constexpr std::size_t enough = 23;  // 8 bytes of it
    alarm.key = {.kind = "certificate", .subject = certificate->fingerprint().substr(0, enough)};
    // A controller with a fingerprint does not check dates (inferred).
    alarm.level = fine                                   ? fabric::AlarmLevel::fine
                  : is_over && role != Role::self_signed ? fabric::AlarmLevel::problem
                                                         : fabric::AlarmLevel::warning;
    alarm.text = fmt::format(
        "the {} \"{}\" for Secure ADS with {} {}", role == Role::ca ? "CA" : "certificate",
        certificate->common_name(), names_of(of_machines),
        is_over
            ? fmt::format("expired on {:%F %R} UTC", until)
            : fmt::format("expires on {:%F %R} UTC, in {}", until, fabric::time_left(until, now)));
    alarm.advice = fine ? "" : advice_of(role);
  }
  return alarms;
}

}  // namespace millrace::gateway::shell
