#include "tools/commands/doctor/doctor.hpp"

#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/configuration.hpp"
#include "fabric/profile/command_line.hpp"
#include "fabric/profile/credentials.hpp"
#include "idl/fabric.pb.h"
#include "tools/commands/arguments.hpp"
#include "tools/doctor/diagnose.hpp"
#include "tools/doctor/examine.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::doctor {

namespace {

namespace program = base::program;
using namespace tools::doctor;

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace doctor"}) {
    add_duration(command, "--wait", wait, "Listen for this time; default 1200ms");
    add_json(command, json);
  }

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds wait = std::chrono::milliseconds(1200);
  bool json = false;
};

std::string role_of(const Findings& found, const Program& program) {
  std::string role = program.self               ? "this command"
                     : !program.is_gateway      ? ""
                     : is_heard(found, program) ? "gateway"
                                                : "gateway, not received";
  for (const std::string& uuid : program.serves) {
    role += (role.empty() ? "serves " : ", ") + base::text::safe(uuid);
  }
  if (!role.empty()) {
    return role;
  }
  return program.fabrics.empty() ? "no millrace program" : "looks on";
}

std::string fabrics_of(const Program& program) {
  std::string text;
  for (const std::string& fabric : program.fabrics) {
    text += (text.empty() ? "" : ", ") + base::text::safe(fabric);
  }
  return text.empty() ? "-" : text;
}

void print_text(const Findings& found, const std::vector<Diagnosis>& diagnoses) {
  fmt::print("fabric '{}', domain {}, interface {}, {}{}\n\n",
             base::text::safe(found.joining.fabric), found.joining.domain,
             base::text::safe(found.joining.interface),
             found.joining.multicast ? "found by multicast" : "no multicast",
             found.joining.peers.empty()
                 ? ""
                 : fmt::format(", peers {}", fmt::join(found.joining.peers, ", ")));
  print::Table table({{"PROGRAM"}, {"HOST"}, {"PID"}, {"ADDRESS"}, {"FABRIC"}, {"ROLE"}});
  for (const Program& each : found.programs) {
    table.add({each.name.empty() ? "-" : base::text::safe(each.name),
               each.host.empty() ? "-" : base::text::safe(each.host),
               each.pid.empty() ? "-" : base::text::safe(each.pid),
               base::text::safe(each.addresses), fabrics_of(each), role_of(found, each)});
  }
  if (!table.empty()) {
    fmt::print("{}\n", table.text());
  }
  for (const Diagnosis& each : diagnoses) {
    fmt::print("{:<8} {}\n", name_of(each.severity), each.what);
    if (!each.advice.empty()) {
      fmt::print("{:<8} -> {}\n", "", each.advice);
    }
  }
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
    print_text(found, diagnoses);
  }
  return is_healthy(diagnoses) ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_doctor(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "doctor", "Find problems of a fabric, and what to do about them",
                     "millrace doctor --fabric-config /etc/millrace/fabric.textproto");
  auto options = std::make_shared<Options>(command);
  command.callback(
      [options, &chosen] { chosen.run = [options] { return examine_and_report(*options); }; });
}

tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join) {
  tools::doctor::Joining joining{
      .fabric = join.fabric,
      .domain = join.domain,
      .cyclone_uri = fabric::dds::uses_uri(join) && std::getenv("CYCLONEDDS_URI") != nullptr,
      .version = MILLRACE_VERSION};
  if (!flags.file().empty()) {
    const auto profile = base::configuration::read_config<config::Fabric>(flags.file());
    if (!profile) {
      throw base::program::UsageError(profile.error());
    }
    joining.interface = profile->interface();
    joining.multicast = profile->multicast();
    joining.peers.assign(profile->peers().begin(), profile->peers().end());
    if (profile->has_trust()) {
      joining.now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
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
