// millrace services: the services of a fabric and their instances.
#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/commands/look/service_rows.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

constexpr const char* no_service =
    "no service is on fabric '{}', domain {}; check --fabric, --domain and --fabric-config";

struct ServicesOptions : LookOptions {
  explicit ServicesOptions(CLI::App& command)
      : LookOptions(command, "S",
                    "Only this service: its UUID, its name, an instance, or the beginning of one") {
    command.add_flag("-i,--instances", instances, "One row for each instance");
    command.add_flag("--full", full, "All that each instance announces");
    command.add_flag("--ping", ping, "Ask each instance to answer; 1 if one does not");
    add_duration(command, "--timeout", timeout, "With --ping: wait this long; 2s unless given");
  }

  bool instances = false;
  bool full = false;
  bool ping = false;
  std::chrono::nanoseconds timeout = std::chrono::seconds(2);
};

/// False if one does not answer.
bool ask(const ServicesOptions& options, std::vector<InstanceRow>& rows) {
  std::vector<fabric::InstanceIdentity> instances;
  for (const InstanceRow& row : rows) {
    instances.push_back(row.instance->identity);
  }
  const auto answers =
      operate::send_to_each(options.fabric, options.timeout, fabric::CommandKind::ping, instances);
  bool all = true;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].was_asked = true;
    rows[i].answer = answers[i];
    all = all && operate::is_done(answers[i]);
  }
  return all;
}

void print_in_full(const InstanceRow& row) {
  const fabric::InstanceIdentity& identity = row.instance->identity;
  fmt::print("{} {}\n", base::text::safe(identity.name), identity.id.to_string());
  const auto line = [](std::string_view name, const std::string& value) {
    fmt::print("  {:<17} {}\n", name, base::text::safe(value));
  };
  line("uuid", identity.uuid);
  line("description", identity.description);
  line("version", identity.version);
  line("host", fmt::format("{}, process {}", identity.host, identity.pid));
  line("channels", channels_text(identity));
  line("delivery", std::string(name_of(identity.delivery)));
  line("completion signal", std::string(name_of(identity.completion_signal)));
  line("concurrency", std::to_string(identity.concurrency));
  line("draining", identity.draining ? "yes" : "no");
  if (!identity.certificate.empty()) {
    line("certificate", identity.certificate);
  }
  if (row.instance->status) {
    line("started", print::time_text(row.instance->status->started));
  }
}

int list_instances(const ServicesOptions& options, const fabric::plant::Plant& live) {
  std::vector<InstanceRow> rows = instance_rows(live, options.output.is_text());
  rows = chosen(std::move(rows), options.what,
                [](const InstanceRow& row) { return names_of(*row.instance); });
  if (rows.empty() && !options.what.empty()) {
    return print_unknown_service(options.what, live, options.fabric.options());
  }
  const bool all_answer = !options.ping || ask(options, rows);
  if (options.full && options.output.is_text()) {
    std::ranges::for_each(rows, &print_in_full);
  } else {
    options.show(instances_listing(), rows, "service", {}, no_service);
  }
  return all_answer ? base::program::exit_done : base::program::exit_failed;
}

Names names_of_service(const ServiceRow& row) {
  Names names{row.uuid, row.name};
  for (const fabric::plant::KnownInstance* instance : row.instances) {
    names.push_back(instance->identity.name);
    names.push_back(instance->identity.id.to_string());
  }
  return names;
}

int list_services(const ServicesOptions& options, const fabric::plant::Plant& live) {
  const std::vector<ServiceRow> all = service_rows(live, std::chrono::system_clock::now());
  Names known;
  for (const ServiceRow& row : all) {
    known.push_back(row.name.empty() ? row.uuid : fmt::format("{} ({})", row.name, row.uuid));
  }
  return options.show(services_listing(), chosen(all, options.what, &names_of_service), "service",
                      known, no_service);
}

}  // namespace

void add_services(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "services", "The services: instances, load, problems",
                     "millrace services\n"
                     "  millrace services -i --json\n"
                     "  millrace services 560aacbf-6335-44a9-895a-8b27f3ed5e47 --full\n"
                     "  millrace services square_root --ping");
  auto options = std::make_shared<ServicesOptions>(command);
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    const fabric::plant::Plant live = wanted.look();
    return wanted.instances || wanted.full || wanted.ping ? list_instances(wanted, live)
                                                          : list_services(wanted, live);
  });
}

}  // namespace millrace::tools::commands::look
