#include "gateway/shell/alarms.hpp"

#include <map>
#include <string>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/messages/catalogue.hpp"
#include "base/openssl/certificate.hpp"
#include "base/text/cp1252.hpp"
#include "fabric/observer/entry.hpp"
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
    } else if (const auto* const shared =
                   std::get_if<cnc::ads::SharedCa>(&*machine.controller.security)) {
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

/// "archiver on press-pc, pid 812"
std::string name_of(const fabric::InstanceIdentity& instance) {
  return fmt::format("{} on {}, pid {}", instance.name, instance.host, instance.pid);
}

/// Bytes of a response that an alarm quotes.
constexpr std::size_t most_text_in_alarm = 127;

/// The services of this project begin the text of an error so (services/text/answer.hpp). Our
/// choice for all others: which of their states are errors is not known here.
bool is_error(const fabric::Reply& reply) {
  return fabric::observer::is_failure(reply) || reply.text.starts_with("ERROR");
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

// An alarm that cannot be written now is repeated with all others.

void GatewayAlarms::publish_certificates(const std::vector<settings::MachineSettings>& machines,
                                         Moment now) {
  std::map<std::string, fabric::Alarm> before = std::exchange(certificates_, {});
  for (fabric::Alarm& alarm :
       certificate_alarms(machines, std::chrono::floor<std::chrono::seconds>(now.wall))) {
    const auto known = before.extract(alarm.key.subject);
    const bool is_new = known.empty() || known.mapped().level != alarm.level;
    if (is_new && alarm.level != fabric::AlarmLevel::fine) {
      log_->warn("{}: {}", alarm.text, alarm.advice);
    }
    static_cast<void>(endpoint_.raise(alarm));
    certificates_.insert_or_assign(alarm.key.subject, std::move(alarm));
  }
  for (const auto& [subject, gone] : before) {
    static_cast<void>(endpoint_.clear(gone.key.kind, subject));
  }
}

void GatewayAlarms::on_ready(const fabric::InstanceIdentity& instance, bool is_new, Moment now) {
  if (lines_.admit(now.steady)) {
    const std::string more = !is_new ? (instance.draining ? ": it is draining" : "")
                             : instance.certificate.empty()
                                 ? ""
                                 : ", trusted as " + instance.certificate;
    log_->info("instance {} of {} {}: {}{}", instance.id.to_string(), instance.uuid,
               is_new ? "is ready" : "changed", name_of(instance), more);
  }
  if (lost_.on_ready(instance)) {
    static_cast<void>(endpoint_.clear("service", instance.uuid));
  }
}

void GatewayAlarms::on_gone(const fabric::InstanceId& instance, Moment now) {
  if (lines_.admit(now.steady)) {
    const fabric::InstanceIdentity* const known = lost_.find(instance);
    log_->info("instance {} is gone{}", instance.to_string(),
               known == nullptr ? "" : ": " + name_of(*known));
  }
  if (const auto last = lost_.on_gone(instance, now.steady)) {
    static_cast<void>(
        endpoint_.raise({.key = {.kind = "service", .subject = last->uuid},
                         .level = fabric::AlarmLevel::warning,
                         .text = base::messages::service_without_instance(last->name, last->uuid,
                                                                          last->pid, last->host),
                         .advice = base::messages::restart_service(last->name, last->host)}));
  }
}

void GatewayAlarms::on_response(const fabric::Reply& reply, Moment now) {
  const bool is_bad = is_error(reply);
  if (!is_bad && errors_.empty()) {
    return;
  }
  const fabric::InstanceIdentity* const by = lost_.find(reply.instance);
  if (by == nullptr) {
    return;
  }
  if (!is_bad) {
    if (errors_.on_success(by->uuid)) {
      static_cast<void>(endpoint_.clear("errors", by->uuid));
    }
  } else if (const auto level = errors_.on_error(by->uuid, now.steady)) {
    static_cast<void>(endpoint_.raise(
        {.key = {.kind = "errors", .subject = by->uuid},
         .level = *level,
         .text = base::messages::responses_are_errors(
             errors_.length(by->uuid), by->name,
             fabric::shortened(base::text::to_utf8(reply.text), most_text_in_alarm)),
         .advice = base::messages::check_service()}));
  }
}

void GatewayAlarms::on_time(Moment now) {
  if (const auto left_out = lines_.due(now.steady)) {
    log_->warn("{} more changes of instances in {} s were not logged one by one", *left_out,
               lines_.window().count());
  }
  for (const std::string& uuid : lost_.on_time(now.steady)) {
    static_cast<void>(endpoint_.clear("service", uuid));
  }
  for (const std::string& uuid : errors_.on_time(now.steady)) {
    static_cast<void>(endpoint_.clear("errors", uuid));
  }
}

}  // namespace millrace::gateway::shell
