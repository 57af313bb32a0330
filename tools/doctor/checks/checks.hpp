// Each checks a part of the findings and reports the result. Pure.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/messages/message.hpp"
#include "fabric/plant/concern.hpp"
#include "tools/doctor/announcement.hpp"
#include "tools/doctor/diagnose.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

// The diagnoses of the doctor, in the order in which they are found.

class Report {
 public:
  using Message = base::messages::Message;

  void problem(Message what, Message advice) {
    diagnoses_.push_back({Severity::problem, std::move(what), steps(std::move(advice))});
  }
  void warning(Message what, Message advice) {
    diagnoses_.push_back({Severity::warning, std::move(what), steps(std::move(advice))});
  }
  void fine(Message what) { diagnoses_.push_back({Severity::fine, std::move(what), {}}); }
  /// Its subject, what is wrong and why, as one sentence.
  void concern(const fabric::plant::Concern& concern);

  [[nodiscard]] std::size_t size() const { return diagnoses_.size(); }
  [[nodiscard]] std::vector<Diagnosis> take() && { return std::move(diagnoses_); }

 private:
  static std::vector<Message> steps(Message advice) {
    return advice.empty() ? std::vector<Message>{} : std::vector<Message>{std::move(advice)};
  }

  std::vector<Diagnosis> diagnoses_;
};

/// Does the interface exist, is it up, and does it support what the fabric needs?
void at_the_interface(const Findings& found, Report& report);
/// Are gateways and services on this fabric, and if not: why?
void gateways_and_services(const Findings& found, Report& report);
/// Is each configured peer there, and if not: why?
void at_peers(const Findings& found, Report& report);
/// The certificate of this process, its validity, and which other participants it accepts.
void at_trust(const Findings& found, Report& report);
/// Endpoints and instances that fit no millrace program.
void at_endpoints(const Findings& found, Report& report);
/// How gateways connect to their controllers.
void at_machines(const Findings& found, Report& report);
/// The concerns of the fabric, the same as on the page and in `millrace status`.
void at_concerns(const Findings& found, Report& report);
/// Reports of processes that run well, and floods of alarms.
void at_alarms(const Findings& found, Report& report);
/// Different versions on one fabric.
void at_versions(const Findings& found, Report& report);
/// Do the clocks of the hosts agree?
void at_clocks(const Findings& found, Report& report);

// Texts for findings.

/// "a, b, c", fit for a terminal.
std::string list_of(const std::set<std::string>& names);
/// "name on host, pid 17", as far as it is known.
base::messages::Message program_text(const Announcement& who);
base::messages::Message program_text(const Program& program);

// The interface by which this process joins the fabric.

/// nullptr if this host has none of that name or address.
const Interface* own_interface(const Findings& found);
/// Only processes of this host are visible then.
bool on_loopback(const Findings& found);

// Processes that should be on the fabric and are not: where are they?

/// Multicast arrives, but packets to one host alone do not.
void for_half_deaf(const Findings& found, Report& report);
/// This fabric has no other process; the domain has the fabrics `others`.
void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report);

}  // namespace millrace::tools::doctor::checks
