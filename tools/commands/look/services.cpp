// millrace services: the services of a fabric and their instances.
#include <algorithm>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/commands/look/service_rows.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/data.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;
using print::Cell;
using print::only_wide;

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

template <typename Number>
Cell number(Number value) {
  return static_cast<std::int64_t>(value);
}

const print::Listing<ServiceRow>& services_listing() {
  static const print::Listing<ServiceRow> services{
      {"SERVICE", "",
       [](const auto& row) -> Cell { return row.name.empty() ? row.uuid : row.name; }},
      {"", "name", [](const auto& row) -> Cell { return row.name; }},
      {"UUID", "uuid", [](const auto& row) -> Cell { return row.uuid; }, Align::left, 5},
      {"INSTANCES", "instances", [](const auto& row) { return number(row.instances.size()); },
       Align::right, 1},
      {"BUSY", "",
       [](const auto& row) -> Cell {
         return row.instances.empty() ? Cell() : fmt::format("{}/{}", row.running, row.capacity);
       },
       Align::right, 2},
      {"", "running", [](const auto& row) { return number(row.running); }},
      {"", "capacity", [](const auto& row) { return number(row.capacity); }},
      {"WAITING", "waiting", [](const auto& row) { return number(row.waiting); }, Align::right, 3},
      {"CALLS", "answered_calls", [](const auto& row) { return number(row.answered); },
       Align::right, 4},
      {"ERRORS", "failed", [](const auto& row) { return number(row.failed); }, Align::right, 4},
      {"MEAN", "mean_ms",
       [](const auto& row) -> Cell { return row.mean ? Cell(*row.mean) : Cell(); }, Align::right,
       4},
      {"PROBLEM", "problem", [](const auto& row) -> Cell { return row.problem; }}};
  return services;
}

struct InstanceRow {
  const bus::KnownInstance* instance = nullptr;
  bool is_gone = false;
  std::vector<const fabric::Alarm*> alarms{};
  bool was_asked = false;
  std::optional<bus::CommandResult> answer{};
};

const fabric::InstanceIdentity& identity_of(const InstanceRow& row) {
  return row.instance->identity;
}
const fabric::InstanceStatus* status_of(const InstanceRow& row) {
  return row.instance->status ? &*row.instance->status : nullptr;
}

template <auto member>
Cell count(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell() : number(status->*member);
}
template <auto member>
Cell moment(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell() : Cell(status->*member);
}
Cell mean_of(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr || status->answered == 0 ? Cell() : Cell(status->mean);
}
Cell busy_of(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell()
                           : fmt::format("{}/{}", status->running, identity_of(row).concurrency);
}

std::string channels_text(const fabric::InstanceIdentity& identity) {
  std::vector<std::string> scopes;
  for (const fabric::ChannelScope& scope : identity.channels) {
    scopes.push_back(fabric::format_channel_scope(scope));
  }
  return scopes.empty() ? "all" : fmt::format("{}", fmt::join(scopes, " "));
}

Cell problem_of(const InstanceRow& row) {
  std::vector<std::string> problems;
  if (row.is_gone) {
    problems.emplace_back("no heartbeat; its process is frozen or has ended");
  }
  if (identity_of(row).draining) {
    problems.emplace_back("draining");
  }
  for (const fabric::Alarm* alarm : row.alarms) {
    if (alarm->level != fabric::AlarmLevel::fine) {
      problems.push_back(alarm->text);
    }
  }
  return fmt::format("{}", fmt::join(problems, "; "));
}

Cell alarms_of(const InstanceRow& row) {
  boost::json::array all;
  for (const fabric::Alarm* alarm : row.alarms) {
    all.push_back(print::json_of(*alarm));
  }
  return all.empty() ? Cell() : Cell(boost::json::value(std::move(all)));
}

Cell answer_of(const InstanceRow& row) {
  return !row.was_asked ? Cell() : row.answer ? row.answer->outcome.detail : "no answer";
}

const print::Listing<InstanceRow>& instances_listing() {
  using Status = fabric::InstanceStatus;
  using Row = InstanceRow;
  static const auto instances =
      print::Listing<Row>{
          {"NAME", "", [](const Row& row) -> Cell { return identity_of(row).name; }},
          {"HOST", "", [](const Row& row) -> Cell { return identity_of(row).host; }, Align::left,
           1},
          {"PID", "", [](const Row& row) { return number(identity_of(row).pid); }, Align::right, 1},
          {"ANSWER", "", &answer_of, Align::left, 1},
          {"AFTER", "after_ms",
           [](const Row& row) -> Cell { return row.answer ? Cell(row.answer->after) : Cell(); },
           Align::right, 1},
          {"BUSY", "", &busy_of, Align::right, 2},
          {"CALLS", "", &count<&Status::answered>, Align::right, 3},
          {"ERRORS", "", &count<&Status::failed>, Align::right, 4},
          {"MEAN", "", &mean_of, Align::right, 4},
          {"LAST CALL", "", &moment<&Status::last_call>, Align::right, 6},
          {"CHANNELS", "", [](const Row& row) -> Cell { return channels_text(identity_of(row)); },
           Align::left, 5},
          {"UP", "", &moment<&Status::started>, Align::right, 6},
          {"UUID", "", [](const Row& row) -> Cell { return identity_of(row).uuid; }, Align::left,
           7},
          {"INSTANCE", "", [](const Row& row) -> Cell { return identity_of(row).id.to_string(); },
           Align::left, 9},
          {"DELIVERY", "",
           [](const Row& row) -> Cell { return std::string(name_of(identity_of(row).delivery)); },
           Align::left, 8},
          {"CERTIFICATE", "", [](const Row& row) -> Cell { return identity_of(row).certificate; },
           Align::left, 6},
          {"WAITING", "", &count<&Status::waiting>, Align::right, only_wide},
          {"REPEATED", "", &count<&Status::repeated>, Align::right, only_wide},
          {"CANCELLED", "", &count<&Status::cancelled>, Align::right, only_wide},
          {"DECLINED", "", &count<&Status::declined>, Align::right, only_wide},
          {"PROBLEM", "", &problem_of},
          {"", "answered",
           [](const Row& row) -> Cell {
             return row.was_asked ? Cell(row.answer.has_value()) : Cell();
           }},
          {"", "detail",
           [](const Row& row) -> Cell {
             return row.answer ? Cell(row.answer->outcome.detail) : Cell();
           }},
          {"", "alarms", &alarms_of}}
          .with_fields<fabric::InstanceIdentity>([](const Row& row) { return &identity_of(row); })
          .with_fields<Status>(&status_of);
  return instances;
}

std::vector<InstanceRow> instance_rows(const bus::FabricModel& live,
                                       const ServicesOptions& options) {
  std::vector<InstanceRow> rows;
  for (const auto& [id, gone] : live.gone()) {
    if (options.output.is_text()) {
      rows.push_back({.instance = &gone.last, .is_gone = true});
    }
  }
  for (const bus::KnownInstance* instance : live.instances_of("")) {
    rows.push_back({.instance = instance});
  }
  rows = chosen(std::move(rows), options.what,
                [](const InstanceRow& row) { return names_of(*row.instance); });
  for (InstanceRow& row : rows) {
    for (const auto& [key, alarm] : live.alarms()) {
      if (key.responder == identity_of(row).id) {
        row.alarms.push_back(&alarm);
      }
    }
  }
  std::ranges::stable_sort(rows, {}, [](const InstanceRow& row) {
    const fabric::InstanceIdentity& identity = identity_of(row);
    return std::tuple(std::get<std::string>(problem_of(row)).empty(), identity.name, identity.host,
                      identity.pid);
  });
  return rows;
}

/// False if one does not answer.
bool ask(const ServicesOptions& options, std::vector<InstanceRow>& rows) {
  std::vector<fabric::InstanceIdentity> instances;
  for (const InstanceRow& row : rows) {
    instances.push_back(identity_of(row));
  }
  const auto answers = operate::print_each(options.fabric.options(), options.timeout,
                                           fabric::CommandKind::ping, instances);
  bool all = true;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].was_asked = true;
    rows[i].answer = answers[i];
    all = all && operate::is_done(answers[i]);
  }
  return all;
}

void print_in_full(const InstanceRow& row) {
  const fabric::InstanceIdentity& identity = identity_of(row);
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
  if (const fabric::InstanceStatus* status = status_of(row)) {
    line("started", print::time_text(status->started));
  }
}

int list_instances(const ServicesOptions& options, const bus::FabricModel& live) {
  std::vector<InstanceRow> rows = instance_rows(live, options);
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
  for (const bus::KnownInstance* instance : row.instances) {
    names.push_back(instance->identity.name);
    names.push_back(instance->identity.id.to_string());
  }
  return names;
}

int list_services(const ServicesOptions& options, const bus::FabricModel& live) {
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
  command.callback([options, &chosen] {
    chosen.run = [options] {
      const bus::FabricModel live = options->look();
      return options->instances || options->full || options->ping ? list_instances(*options, live)
                                                                  : list_services(*options, live);
    };
  });
}

}  // namespace millrace::tools::commands::look
