#include <algorithm>
#include <chrono>
#include <set>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text/quoted.hpp"
#include "fabric/participant_identity.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

/// "gateway-1 as gateway of press_1, press_2"
std::string text_of(const fabric::ParticipantIdentity& identity) {
  return fmt::format("{} as {}{}", safe(identity.name),
                     safe(fmt::format("{}", fmt::join(identity.roles, " and "))),
                     identity.machines.empty()
                         ? std::string()
                         : " of " + safe(fmt::format("{}", fmt::join(identity.machines, ", "))));
}

std::string text_of(const Program& program) {
  return program_text(Announcement{.name = program.name, .host = program.host, .pid = program.pid});
}

void at_our_own(const Joining& joining, Report& report) {
  const std::string text = fmt::format("this process has the certificate of {} until {:%F %R} UTC",
                                       safe(joining.trusted_as), joining.trusted_until);
  if (joining.trusted_until - joining.now > fabric::certificate_expires_soon) {
    report.fine(text);
    return;
  }
  report.warning(fmt::format("{}, which is in {}", text,
                             fabric::time_left(joining.trusted_until, joining.now)),
                 fmt::format("run `millrace trust renew PKI {}` on the admin host, then copy the "
                             "folder again and restart its processes",
                             safe(joining.trusted_as)));
}

}  // namespace

void at_trust(const Findings& found, Report& report) {
  if (found.joining.trusted_as.empty()) {
    return;
  }
  at_our_own(found.joining, report);
  // Hosts with different times have different CRLs.
  report.fine(fmt::format("revoked as of {:%F %T} UTC: {}", found.joining.revoked_as_of,
                          found.joining.revoked.empty() ? "none" : list_of(found.joining.revoked)));
  // A participant whose endpoints discovery shows here has proved its certificate.
  std::set<std::string> believed;
  for (const ReceivedAnnouncement& each : found.heard) {
    const auto program = std::ranges::find(found.programs, each.who.prefix, &Program::prefix);
    if (program != found.programs.end() && !program->self && !program->fabrics.empty() &&
        each.who.shows_certificate) {
      believed.insert(text_of(*program) +
                      (each.who.certificate.empty() ? "" : " as " + safe(each.who.certificate)));
    }
  }
  if (!believed.empty()) {
    report.fine("accepted here: " + list_of(believed));
  }
  std::set<std::string> proved;
  for (const fabric::ParticipantIdentity& identity : found.identities) {
    proved.insert(text_of(identity));
  }
  if (!proved.empty()) {
    report.fine("trusted: " + list_of(proved));
  }
  for (const Program& program : found.programs) {
    if (!program.announces_identity && program.fabrics.contains(found.joining.fabric)) {
      report.problem(
          fmt::format("{} has a certificate of this PKI and announces no identity: its "
                      "samples are ignored, and its instances get no calls",
                      text_of(program)),
          "it runs an earlier version of millrace: renew its credentials with `millrace "
          "trust renew`, and start it with this version; docs/reference/wire.md says how another "
          "vendor's DDS announces an identity");
    }
  }
  for (const std::string& doubt : found.doubts) {
    report.problem(
        doubt,
        "if it is yours, issue it a certificate that allows this with `millrace trust issue`; if "
        "not, revoke its certificate with `millrace trust revoke` and find out what runs there");
  }
}

}  // namespace millrace::tools::doctor::checks
