#include "tools/commands/doctor/doctor.hpp"

#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "base/program/version.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/configuration.hpp"
#include "fabric/plant/concern.hpp"
#include "fabric/profile/command_line.hpp"
#include "fabric/profile/credentials.hpp"
#include "fabric/profile/given_flags.hpp"
#include "idl/fabric.pb.h"
#include "tools/commands/arguments.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/doctor/examine.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::doctor {

namespace {

namespace program = base::program;
using namespace tools::doctor;

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace doctor"}) {
    add_duration(command, "--wait", wait, "Listen for this time; default 1200ms");
    command.add_flag("--all", all, "Also what is fine");
    add_json(command, json);
  }

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds wait = std::chrono::milliseconds(1200);
  bool all = false;
  bool json = false;
};

/// What it is for this fabric.
print::Cell role_of(const Findings& found, const Program& program) {
  std::string role = program.self                  ? "this command"
                     : !program.is_gateway         ? ""
                     : is_received(found, program) ? "gateway"
                                                   : "gateway, not received";
  for (const std::string& uuid : program.serves) {
    role += (role.empty() ? "serves " : ", ") + uuid;
  }
  return !role.empty() ? role : program.fabrics.empty() ? "not a process of millrace" : "observer";
}

struct ProgramRow {
  const Findings* found;
  const Program* program;
};

const print::Listing<ProgramRow>& programs_listing() {
  static const print::Listing<ProgramRow> programs{
      {"PROCESS", "", [](const auto& row) -> print::Cell { return row.program->name; }},
      {"HOST", "", [](const auto& row) -> print::Cell { return row.program->host; }},
      {"PID", "", [](const auto& row) -> print::Cell { return row.program->pid; },
       print::Align::right},
      {"ADDRESS", "", [](const auto& row) -> print::Cell { return row.program->addresses; },
       print::Align::left, 2},
      {"FABRIC", "",
       [](const auto& row) -> print::Cell {
         return fmt::format("{}", fmt::join(row.program->fabrics, ", "));
       },
       print::Align::left, 1},
      {"ROLE", "", [](const auto& row) { return role_of(*row.found, *row.program); }}};
  return programs;
}

int examine_and_report(const Options& options) {
  const fabric::dds::ParticipantOptions join = options.fabric.options();
  const Findings found =
      examine({.join = join,
               .joining = joining_of(options.fabric, join),
               .listen = std::chrono::ceil<std::chrono::milliseconds>(options.wait)});
  const std::vector<Diagnosis> diagnoses = diagnose(found);
  if (options.json) {
    print::print_json(json_of(found, diagnoses));
  } else {
    fmt::print("{}", text_of(found, diagnoses, width_of_output(), options.all));
  }
  return is_healthy(diagnoses) ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_doctor(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "doctor", "Find problems of a fabric, and what to do about them",
                     "millrace doctor --fabric-config /etc/millrace/fabric.textproto");
  auto options = std::make_shared<Options>(command);
  run_if_chosen(command, chosen, options, examine_and_report);
}

namespace {

std::string text_of(const Diagnosis& diagnosis, std::size_t width) {
  std::string text = print::wrapped(
      fmt::format("{:<8} {}", name_of(diagnosis.severity), base::text::safe(diagnosis.what.text)),
      width, 9);
  if (const std::string advice = fabric::plant::advice_of(diagnosis.todo); !advice.empty()) {
    text += print::wrapped(fmt::format("{:<8} -> {}", "", base::text::safe(advice)), width, 12);
  }
  return text;
}

/// "no problem; 5 checks are fine (--all)", as far as it is so.
std::string summary_of(std::size_t faults, std::size_t fine, bool all) {
  const std::string rest =
      all || fine == 0 ? ""
                       : fmt::format("{} fine (--all shows {})",
                                     fine == 1 ? "1 check is" : fmt::format("{} checks are", fine),
                                     fine == 1 ? "it" : "them");
  return faults > 0 ? rest : "no problem" + (rest.empty() ? "" : "; " + rest);
}

}  // namespace

std::string text_of(const Findings& found, const std::vector<Diagnosis>& diagnoses,
                    std::size_t width, bool all) {
  const Joining& joining = found.joining;
  std::string text = print::wrapped(
      base::text::safe(fmt::format(
          "fabric '{}', domain {}, interface {}, {}{}", joining.fabric, joining.domain,
          joining.interface, joining.multicast ? "found by multicast" : "no multicast",
          joining.peers.empty() ? "" : fmt::format(", peers {}", fmt::join(joining.peers, ", ")))),
      width, 2);
  std::string faults;
  std::string fine;
  std::size_t fault_count = 0;
  std::size_t fine_count = 0;
  for (const Diagnosis& each : diagnoses) {
    const bool is_fine = each.severity == Severity::fine;
    (is_fine ? fine : faults) += text_of(each, width);
    ++(is_fine ? fine_count : fault_count);
  }
  if (!faults.empty()) {
    text += '\n' + faults;
  }
  std::vector<ProgramRow> programs;
  for (const Program& each : found.programs) {
    programs.push_back({&found, &each});
  }
  if (!programs.empty()) {
    text += '\n' + programs_listing().text(programs, {.width = width}, {});
  }
  if (all && !fine.empty()) {
    text += '\n' + fine;
  }
  if (const std::string summary = summary_of(fault_count, fine_count, all); !summary.empty()) {
    text += '\n' + summary + '\n';
  }
  return text;
}

tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join) {
  tools::doctor::Joining joining{
      .fabric = join.fabric,
      .domain = join.domain,
      .flags = fabric::profile::given_flags(flags),
      .cyclone_uri = fabric::dds::uses_uri(join) && std::getenv("CYCLONEDDS_URI") != nullptr,
      .version = program::version(),
      .now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now())};
  if (!flags.file().empty()) {
    const auto profile = base::configuration::read_config<config::Fabric>(flags.file());
    if (!profile) {
      throw base::program::UsageError(profile.error());
    }
    joining.interface = profile->interface();
    joining.multicast = profile->multicast();
    joining.peers.assign(profile->peers().begin(), profile->peers().end());
    if (profile->has_trust()) {
      const auto credentials = fabric::profile::credentials_of(profile->trust(), flags.file());
      if (!credentials) {
        throw base::program::UsageError(credentials.error());
      }
      joining.trusted_as = credentials->name;
      joining.trusted_until = credentials->until;
      joining.revoked = credentials->revoked;
      joining.revoked_as_of = credentials->revoked_as_of;
    }
  }
  return joining;
}

}  // namespace millrace::tools::commands::doctor
