#include "tools/commands/operate/operate.hpp"

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::operate {

namespace program = base::program;

namespace {

std::chrono::milliseconds patience_of(const OperateOptions& options) {
  return std::chrono::ceil<std::chrono::milliseconds>(options.timeout);
}

boost::json::object json_of(const fabric::InstanceIdentity& identity,
                            const bus::CommandResult* heard) {
  boost::json::object out{{"instance", identity.id.to_string()},
                          {"name", print::utf8(identity.name)},
                          {"answered", heard != nullptr}};
  if (heard != nullptr) {
    out["done"] = heard->outcome.done;
    out["detail"] = print::utf8(heard->outcome.detail);
    out["after_ms"] = std::chrono::duration<double, std::milli>(heard->after).count();
  }
  return out;
}

std::string line_of(const fabric::InstanceIdentity& identity, const bus::CommandResult* heard) {
  const std::string who = fmt::format("{} {} on {}", base::text::safe(identity.name),
                                      identity.id.to_string(), base::text::safe(identity.host));
  return heard == nullptr
             ? who + ": no answer"
             : fmt::format("{}: {}, after {}", who, base::text::safe(heard->outcome.detail),
                           print::duration_text(heard->after));
}

}  // namespace

OperateOptions::OperateOptions(CLI::App& command) : fabric(command, {.name = "millrace"}) {
  add_duration(command, "--timeout", timeout, "Wait for the outcome for this time; default 2s");
  add_json(command, json);
}

fabric::Command new_command(fabric::CommandKind kind) {
  return {.id = fabric::InstanceId::random(),
          .kind = kind,
          .issuer = bus::issuer_here(),
          .at = std::chrono::system_clock::now()};
}

bool tell_each(const OperateOptions& options, fabric::CommandKind kind,
               const std::vector<fabric::InstanceIdentity>& instances, boost::json::array& out) {
  std::vector<fabric::Command> commands;
  for (const fabric::InstanceIdentity& instance : instances) {
    commands.push_back(new_command(kind));
    commands.back().instance = instance.id;
  }
  fabric::dds::Participant participant(options.fabric.options());
  const auto heard = bus::issue(participant, commands, patience_of(options));
  bool all_done = true;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto word = heard.find(commands[i].id);
    const bus::CommandResult* answer = word != heard.end() ? &word->second : nullptr;
    all_done = all_done && answer != nullptr && answer->outcome.done;
    if (options.json) {
      out.push_back(json_of(instances[i], answer));
    } else {
      fmt::print("{}\n", line_of(instances[i], answer));
    }
  }
  return all_done;
}

int tell_instances(const OperateOptions& options, const bus::FabricModel& live,
                   fabric::CommandKind kind, const std::string& what) {
  std::vector<fabric::InstanceIdentity> instances;
  for (const bus::KnownInstance* instance : live.instances_of(what)) {
    instances.push_back(instance->identity);
  }
  if (what.empty() || instances.empty()) {
    fmt::print(stderr,
               "millrace: no instance is, or serves, '{}'; 'millrace services' lists them\n", what);
    return program::exit_failed;
  }
  boost::json::array out;
  const bool all_done = tell_each(options, kind, instances, out);
  if (options.json) {
    print::print_json(out);
  }
  return all_done ? program::exit_done : program::exit_failed;
}

void add_channel_key(CLI::App& command, fabric::ChannelKey& key) {
  command
      .add_option_function<std::string>(
          "CHANNEL",
          [&key](const std::string& text) {
            const auto scope = fabric::parse_channel_scope(text);
            if (!scope || scope->machine.empty() || scope->channel == 0) {
              throw CLI::ValidationError(
                  fmt::format("'{}' is not a channel; expected one as in cnc/1", text));
            }
            key = {scope->machine, scope->channel};
          },
          "A channel, as in cnc/1")
      ->required()
      ->type_name("MACHINE/N");
}

int tell_gateway(const OperateOptions& options, const fabric::ChannelKey& key,
                 fabric::Command command) {
  const auto is_pending = [&key](const bus::FabricModel& seen) {
    const auto found = seen.channels().find(key);
    return found != seen.channels().end() && found->second.call != fabric::CallId{};
  };
  bus::FabricModel live = bus::take_snapshot(options.fabric.options(), {}, is_pending);
  if (!live.channels().contains(key)) {
    // On a busy host its gateway may be heard later than what is announced first.
    live = bus::take_snapshot(options.fabric.options(), {.at_least = std::chrono::seconds(3)},
                              is_pending);
  }
  const auto channel = live.channels().find(key);
  if (!is_pending(live)) {
    fmt::print(stderr, "millrace: no call is pending in {}; 'millrace channels' shows them\n",
               key.to_string());
    return program::exit_failed;
  }
  command.key = key;
  command.call = channel->second.call;
  fabric::dds::Participant participant(options.fabric.options());
  const auto heard = bus::issue(participant, {command}, patience_of(options));
  const auto word = heard.find(command.id);
  if (word == heard.end()) {
    fmt::print(stderr, "millrace: the gateway of {} does not respond\n", key.to_string());
    return program::exit_failed;
  }
  const fabric::Outcome& outcome = word->second.outcome;
  if (options.json) {
    print::print_json(boost::json::object{{"call", command.call.to_string()},
                                          {"done", outcome.done},
                                          {"detail", print::utf8(outcome.detail)}});
  } else {
    fmt::print("call {} of {}: {}\n", command.call.to_string(), key.to_string(),
               base::text::safe(outcome.detail));
  }
  return outcome.done ? program::exit_done : program::exit_failed;
}

}  // namespace millrace::tools::commands::operate
