// millrace status: what needs attention, in words and in one exit code.
#include "tools/commands/status/status.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/posix/system.hpp"
#include "base/text/ascii.hpp"
#include "fabric/plant/assess.hpp"
#include "fabric/plant/expectations.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/look/watch.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/commands/status/overview.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::status {

namespace {

namespace messages = base::messages;

constexpr const char* exit_codes =
    "Exit codes, the first that applies:\n"
    "  0  no problem\n"
    "  1  the fabric lacks what --expect-gateway or --expect-service names; with --host: a\n"
    "     process of the host does not answer, or the host has none\n"
    "  2  a wrong flag or value\n"
    "  3  no gateway is on the fabric, or the link of a machine is down\n"
    "  4  a call is held for an operator\n"
    "  5  a call has no service, or has waited for a free instance for more than a minute, or a\n"
    "     service has lost its last instance in the last quarter of an hour\n"
    "  6  a process reports a problem\n"
    "  7  an NC program was aborted\n"
    "With --host only 0, 1 and 2.\n\n";

struct StatusOptions : look::SnapshotOptions {
  explicit StatusOptions(CLI::App& command);

  /// Only the processes of this host.
  Host host;
  std::vector<std::string> gateways{};
  fabric::plant::Expected services{};
  std::chrono::nanoseconds timeout = std::chrono::seconds(2);
  bool json = false;
  std::optional<look::WatchFlag> watch;
};

/// "UUID=COUNT"
fabric::plant::Expected::value_type expected_service(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  const auto count = equals == std::string::npos || equals == 0
                         ? std::nullopt
                         : base::text::parse_number<std::size_t>(text.substr(equals + 1));
  if (!count) {
    throw CLI::ValidationError(fmt::format(
        "'{}' is not UUID=COUNT; expected a UUID or a name, and a number of instances", text));
  }
  return {text.substr(0, equals), *count};
}

StatusOptions::StatusOptions(CLI::App& command) : SnapshotOptions(command) {
  command
      .add_option_function<std::string>(
          "--host",
          [this](const std::string& name) {
            host = name.empty() ? base::posix::host_name() : name;
          },
          "Only whether the gateways and services of this host are there and answer: for a check "
          "of a container or a host. By default the host of this command")
      ->expected(0, 1)
      ->type_name("NAME");
  command
      .add_option("--expect-gateway", gateways,
                  "A machine whose gateway must report, or the host of a gateway; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      .add_option_function<std::vector<std::string>>(
          "--expect-service",
          [this](const std::vector<std::string>& texts) {
            std::ranges::transform(texts, std::back_inserter(services), &expected_service);
          },
          "A service, by UUID or name, that must have COUNT instances on the fabric or more, not "
          "counting those that drain; may be repeated")
      ->type_name("UUID=COUNT")
      ->allow_extra_args(false);
  add_duration(command, "--timeout", timeout,
               "With --host: wait this long for an answer; 2s "
               "unless given");
  add_json(command, json);
  watch.emplace(command, std::vector<std::string>{"--json", "--host"});
}

/// Processes whose loop may hang: the gateways of a host, in the words of an instance, and its
/// services.
struct Processes {
  operate::Instances gateways;
  operate::Instances instances;
  operate::Answers of_gateways;
  operate::Answers of_instances;
};

Processes ask_processes(const StatusOptions& options, const fabric::plant::Plant& live) {
  Processes found;
  for (const auto& [id, status] : live.gateways()) {
    if (is_on(options.host, status.host)) {
      found.gateways.push_back(
          {.id = id,
           .name = fmt::format("gateway {:012x} (pid {})", status.epoch, status.pid),
           .host = status.host});
    }
  }
  for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
    if (is_on(options.host, instance->identity.host)) {
      found.instances.push_back(instance->identity);
    }
  }
  operate::Instances all = found.gateways;
  all.insert(all.end(), found.instances.begin(), found.instances.end());
  if (!all.empty()) {
    operate::Answers answers =
        operate::send_to_each(options.fabric, options.timeout, fabric::CommandKind::ping, all);
    const auto middle = answers.begin() + static_cast<std::ptrdiff_t>(found.gateways.size());
    found.of_gateways.assign(answers.begin(), middle);
    found.of_instances.assign(middle, answers.end());
  }
  return found;
}

void add_silent(Concerns& concerns, const operate::Instances& instances,
                const operate::Answers& answers) {
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (!operate::is_done(answers[i])) {
      const std::string id = instances[i].id.to_string();
      concerns.push_back({.kind = fabric::plant::Kind::missing,
                          .process = instances[i].name,
                          .what = messages::what_no_answer(),
                          .why = messages::instance_on_host(id, instances[i].host),
                          .todo = {messages::restart_it()},
                          .cause = "no answer " + id});
    }
  }
}

Concerns concerns_of_host(const StatusOptions& options, const fabric::plant::Plant& plant,
                          const Processes& processes) {
  Concerns concerns;
  add_silent(concerns, processes.gateways, processes.of_gateways);
  add_silent(concerns, processes.instances, processes.of_instances);
  if (processes.gateways.empty() && processes.instances.empty() &&
      alarms_on(plant, options.host).empty()) {
    const auto& joined = options.fabric.options();
    const std::string flags = fabric::profile::given_flags(options.fabric);
    concerns.push_back(
        {.kind = fabric::plant::Kind::missing,
         .process = *options.host,
         .what = messages::what_missing_process(),
         .why = messages::no_process_of_host(*options.host, joined.fabric, joined.domain),
         .todo = {messages::list_those_there(),
                  messages::run_command("millrace services -i" + flags),
                  messages::run_command("millrace machines" + flags)},
         .cause = "no process of " + *options.host});
  }
  return concerns;
}

Concerns concerns_of_fabric(const StatusOptions& options, const fabric::plant::Plant& live) {
  return fabric::plant::assess(live, std::chrono::system_clock::now(),
                               {.flags = fabric::profile::given_flags(options.fabric)});
}

/// With what is expected and missing.
Overview overview_of(const StatusOptions& options, const fabric::plant::Plant& live,
                     Concerns concerns) {
  for (const Concerns& more :
       {missing_gateways(live, options.gateways), missing_instances(live, options.services)}) {
    concerns.insert(concerns.end(), more.begin(), more.end());
  }
  fabric::plant::sort(concerns);
  return {live, options.fabric.options().fabric, options.fabric.options().domain, options.host,
          std::move(concerns)};
}

std::string text_now(const Overview& overview) {
  return text_of(overview, width_of_output(), std::chrono::system_clock::now());
}

int check(const StatusOptions& options) {
  if (options.watch->on) {
    return look::watch(options, [&](const fabric::plant::Plant& live) {
      return text_now(overview_of(options, live, concerns_of_fabric(options, live)));
    });
  }
  const fabric::plant::Plant live = options.look();
  std::optional<Processes> asked;
  if (options.host) {
    asked = ask_processes(options, live);
  }
  Overview overview = overview_of(
      options, live,
      asked ? concerns_of_host(options, live, *asked) : concerns_of_fabric(options, live));
  if (options.json) {
    boost::json::object out = json_of(overview);
    if (asked) {
      out["gateways"] = operate::json_of(asked->gateways, asked->of_gateways);
      out["instances"] = operate::json_of(asked->instances, asked->of_instances);
    }
    print::print_json(out);
  } else {
    if (asked) {
      overview.answers = operate::answers_text(asked->gateways, asked->of_gateways) +
                         operate::answers_text(asked->instances, asked->of_instances);
    }
    fmt::print("{}", text_now(overview));
  }
  return exit_code_of(overview.concerns);
}

}  // namespace

void add_status(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "status", "What needs attention, one line per machine; an exit code for monitors",
      "millrace status\n"
      "  millrace status --expect-gateway press --expect-service "
      "560aacbf-6335-44a9-895a-8b27f3ed5e47=2\n"
      "  millrace status --host");
  command.footer(exit_codes + command.get_footer());
  auto options = std::make_shared<StatusOptions>(command);
  run_if_chosen(command, chosen, options, check);
}

}  // namespace millrace::tools::commands::status
