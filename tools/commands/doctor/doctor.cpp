#include "tools/commands/doctor/doctor.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/doctor/joining.hpp"
#include "tools/doctor/diagnose.hpp"
#include "tools/doctor/examine.hpp"
#include "tools/doctor/report_json.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::doctor {

namespace {

namespace program = base::program;
using namespace tools::doctor;

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace doctor"}) {
    add_duration(command, "--wait", wait, "Listen for this time; default 2s");
    add_json(command, json);
  }

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds wait = std::chrono::seconds(2);
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

int examine_and_tell(const Options& options) {
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
      [options, &chosen] { chosen.run = [options] { return examine_and_tell(*options); }; });
}

}  // namespace millrace::tools::commands::doctor
