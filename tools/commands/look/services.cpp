// millrace services: every instance on the fabric.
#include <algorithm>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/alarm_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;

/// With trust, a column shows the proved identity.
bool has_proof(const bus::KnownInstance* instance) {
  return !instance->identity.certificate.empty();
}

std::vector<std::string> row_of(const bus::KnownInstance& instance) {
  const fabric::InstanceIdentity& identity = instance.identity;
  const fabric::InstanceStatus status = instance.status.value_or(fabric::InstanceStatus{});
  return {base::text::safe(identity.uuid),
          base::text::safe(identity.name) + (identity.draining ? " (draining)" : ""),
          base::text::safe(identity.host),
          std::to_string(identity.pid),
          channels_text(identity),
          fmt::format("{}/{}", status.running, identity.concurrency),
          std::to_string(status.answered),
          std::to_string(status.failed),
          print::duration_text(status.mean),
          std::string(fabric::name_of(identity.delivery))};
}

void print_services(const std::vector<const bus::KnownInstance*>& instances) {
  std::vector<print::Column> columns{{"UUID"},
                                     {"NAME"},
                                     {"HOST"},
                                     {"PID", Align::right},
                                     {"CHANNELS"},
                                     {"BUSY", Align::right},
                                     {"CALLS", Align::right},
                                     {"ERRORS", Align::right},
                                     {"MEAN", Align::right},
                                     {"DELIVERY"}};
  const bool proofs = std::ranges::any_of(instances, &has_proof);
  if (proofs) {
    columns.push_back({"CERTIFICATE"});
  }
  print::Table table(columns);
  for (const bus::KnownInstance* instance : instances) {
    std::vector<std::string> row = row_of(*instance);
    if (proofs) {
      row.push_back(base::text::safe(instance->identity.certificate));
    }
    table.add(std::move(row));
  }
  fmt::print("{}", table.text());
}

/// The alarms of all processes, also of those that are not services.
void print_alarms(const bus::FabricModel& live) {
  print::Table table({{"STATE"}, {"PROGRAM"}, {"SINCE", Align::right}, {"WHAT"}, {"TO DO"}});
  for (const auto& [key, alarm] : live.alarms()) {
    table.add({std::string(fabric::name_of(alarm.level)), print::said_by(alarm), ago(alarm.since),
               alarm.text, alarm.advice});
  }
  if (!table.empty()) {
    fmt::print("\n{}", table.text());
  }
}

/// Discovery still shows them, and they send no heartbeat.
void print_silent(const bus::FabricModel& live) {
  for (const auto& [id, gone] : live.gone()) {
    const fabric::InstanceIdentity& identity = gone.last.identity;
    fmt::print("\n{} {} ({}) on {}, pid {}: no heartbeat; its process is frozen or has ended\n",
               base::text::safe(identity.name), id.to_string(), base::text::safe(identity.uuid),
               base::text::safe(identity.host), identity.pid);
  }
}

boost::json::array services_json(const bus::FabricModel& live) {
  boost::json::array out;
  for (const bus::KnownInstance* instance : live.instances_of("")) {
    boost::json::object object = print::json_of(instance->identity, instance->status);
    boost::json::array alarms;
    for (const auto& [key, alarm] : live.alarms()) {
      if (key.responder == instance->identity.id) {
        alarms.push_back(print::json_of(alarm));
      }
    }
    if (!alarms.empty()) {
      object["alarms"] = std::move(alarms);
    }
    out.push_back(std::move(object));
  }
  return out;
}

int list_services(const LookOptions& options) {
  const bus::FabricModel live = options.look();
  const auto instances = live.instances_of("");
  if (options.json) {
    print::print_json(services_json(live));
  } else if (instances.empty()) {
    fmt::print(
        "no service is on fabric '{}', domain {}; check --fabric, --domain and --fabric-config\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    print_services(instances);
  }
  if (!options.json) {
    print_silent(live);
    print_alarms(live);
  }
  return base::program::exit_done;
}

}  // namespace

void add_services(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "services", "All instances of all services, and the alarms of all processes",
      "millrace services --json");
  auto options = std::make_shared<LookOptions>(command);
  command.callback(
      [options, &chosen] { chosen.run = [options] { return list_services(*options); }; });
}

}  // namespace millrace::tools::commands::look
