#include <algorithm>
#include <set>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "fabric/participant_identity.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

namespace messages = base::messages;
using base::text::safe;

/// "gateway-1 as gateway of press_1, press_2"
std::string text_of(const fabric::ParticipantIdentity& identity) {
  return fmt::format("{} as {}{}", safe(identity.name),
                     safe(fmt::format("{}", fmt::join(identity.roles, " and "))),
                     identity.machines.empty()
                         ? std::string()
                         : " of " + safe(fmt::format("{}", fmt::join(identity.machines, ", "))));
}

void at_our_own(const Joining& joining, Report& report) {
  const base::messages::Message text = messages::own_certificate(
      safe(joining.trusted_as), fmt::format("{:%F %R}", joining.trusted_until));
  if (joining.trusted_until - joining.now > fabric::certificate_expires_soon) {
    report.fine(text);
    return;
  }
  report.warning(messages::which_is_in(text, fabric::time_left(joining.trusted_until, joining.now)),
                 messages::renew_credentials(safe(joining.trusted_as)));
}

}  // namespace

void at_trust(const Findings& found, Report& report) {
  if (found.joining.trusted_as.empty()) {
    return;
  }
  at_our_own(found.joining, report);
  // Hosts with different times have different CRLs.
  const std::string as_of = fmt::format("{:%F %T}", found.joining.revoked_as_of);
  report.fine(found.joining.revoked.empty()
                  ? messages::none_revoked(as_of)
                  : messages::revoked_participants(as_of, list_of(found.joining.revoked)));
  // A participant whose endpoints discovery shows here has proved its certificate.
  std::set<std::string> believed;
  for (const ReceivedAnnouncement& each : found.announcements) {
    const auto program = std::ranges::find(found.programs, each.who.prefix, &Program::prefix);
    if (program != found.programs.end() && !program->self && !program->fabrics.empty() &&
        each.who.shows_certificate) {
      believed.insert(program_text(*program).text +
                      (each.who.certificate.empty() ? "" : " as " + safe(each.who.certificate)));
    }
  }
  if (!believed.empty()) {
    report.fine(messages::accepted_here(list_of(believed)));
  }
  std::set<std::string> proved;
  for (const fabric::ParticipantIdentity& identity : found.identities) {
    proved.insert(text_of(identity));
  }
  if (!proved.empty()) {
    report.fine(messages::trusted_participants(list_of(proved)));
  }
  for (const Program& program : found.programs) {
    if (!program.announces_identity && program.fabrics.contains(found.joining.fabric)) {
      report.problem(messages::no_identity_announced(program_text(program).text),
                     messages::runs_earlier_version());
    }
  }
  for (const std::string& doubt : found.doubts) {
    report.problem(doubt, messages::issue_or_revoke());
  }
}

}  // namespace millrace::tools::doctor::checks
