#include "gateway/shell/certificate_alarms.hpp"

#include <map>
#include <string>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/messages/catalogue.hpp"
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
    if (!machine.controller.security) {
      continue;
    }
    if (const auto* const own = std::get_if<cnc::ads::SelfSigned>(&*machine.controller.security)) {
      uses[{Role::self_signed, own->certificate}].push_back(machine.name);
    } else if (const auto* const shared = std::get_if<cnc::ads::SharedCa>(&*machine.controller.security)) {
      uses[{Role::of_a_ca, shared->certificate}].push_back(machine.name);
      uses[{Role::ca, shared->ca}].push_back(machine.name);
    }
  }
  return uses;
}

/// Few enough that the expiry also fits into the alarm.
fabric::Message names_of(const std::vector<std::string>& machines) {
  constexpr std::size_t most = 3;
  if (machines.size() <= most) {
    return fmt::format("{}", fmt::join(machines, ", "));
  }
  return base::messages::and_more(
      fmt::format("{}", fmt::join(machines.begin(), machines.begin() + most, ", ")),
      machines.size() - most);
}

fabric::Message text_of(Role role, const std::string& name, const fabric::Message& machines,
                        std::chrono::sys_seconds until, std::chrono::sys_seconds now) {
  const std::string date = fmt::format("{:%F %R}", until);
  if (until <= now) {
    return role == Role::ca ? base::messages::ads_ca_expired(name, machines, date)
                            : base::messages::ads_certificate_expired(name, machines, date);
  }
  const fabric::Message left = fabric::time_left(until, now);
  return role == Role::ca ? base::messages::ads_ca_expires(name, machines, date, left)
                          : base::messages::ads_certificate_expires(name, machines, date, left);
}

fabric::Message advice_of(Role role) {
  switch (role) {
    case Role::self_signed:
      return base::messages::renew_self_signed();
    case Role::of_a_ca:
      return base::messages::renew_ads_certificate();
    case Role::ca:
      return base::messages::renew_ads_ca();
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
    alarm.text = text_of(role, certificate->common_name(), names_of(of_machines), until, now);
    alarm.advice = fine ? fabric::Message() : advice_of(role);
  }
  return alarms;
}

}  // namespace millrace::gateway::shell
