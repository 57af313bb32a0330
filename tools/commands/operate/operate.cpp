#include "tools/commands/operate/operate.hpp"

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/plant/assess.hpp"
#include "fabric/profile/given_flags.hpp"
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

/// No gateway can be asked: it is gone, or this is the wrong fabric.
void print_why_no_gateway(const fabric::plant::Plant& live, const std::string& flags) {
  using fabric::plant::Kind;
  const auto concerns =
      fabric::plant::assess(live, std::chrono::system_clock::now(), {.flags = flags});
  for (const fabric::plant::Concern& concern : concerns) {
    if (concern.kind == Kind::no_gateway || concern.kind == Kind::gateway_gone) {
      fmt::print(stderr, "millrace: {}: {}; {}\n", concern.what.text,
                 base::text::safe(concern.why.text),
                 base::text::safe(fabric::plant::advice_of(concern.todo)));
    }
  }
}

}  // namespace

std::string result_text(fabric::CommandKind kind, const fabric::Outcome& outcome) {
  if (!outcome.detail.empty()) {
    return base::text::safe(outcome.detail);
  }
  return !outcome.done                        ? "refused"
         : kind == fabric::CommandKind::retry ? "dispatched again"
                                              : "done";
}

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

Answers send_to_each(const fabric::profile::FabricFlags& fabric, std::chrono::nanoseconds patience,
                     fabric::CommandKind kind, const Instances& instances) {
  std::vector<fabric::Command> commands;
  for (const fabric::InstanceIdentity& instance : instances) {
    commands.push_back(new_command(kind));
    commands.back().instance = instance.id;
  }
  fabric::dds::Participant participant(fabric.options());
  const auto outcomes =
      bus::issue(participant, commands, std::chrono::ceil<std::chrono::milliseconds>(patience),
                 fabric::profile::given_flags(fabric));
  Answers answers;
  for (const fabric::Command& command : commands) {
    const auto word = outcomes.find(command.id);
    answers.push_back(word == outcomes.end() ? std::nullopt : std::optional(word->second));
  }
  return answers;
}

bool is_done(const std::optional<bus::CommandResult>& answer) {
  return answer && answer->outcome.done;
}

std::string answers_text(const Instances& instances, const Answers& answers) {
  std::string text;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    text += fmt::format(
        "{} {} on {}: {}\n", base::text::safe(instances[i].name), instances[i].id.to_string(),
        base::text::safe(instances[i].host),
        answers[i] ? fmt::format("{}, after {}", base::text::safe(answers[i]->outcome.detail),
                                 print::duration_text(answers[i]->after))
                   : "no answer");
  }
  return text;
}

boost::json::array json_of(const Instances& instances, const Answers& answers) {
  boost::json::array all;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    boost::json::object out{{"instance", instances[i].id.to_string()},
                            {"name", print::utf8(instances[i].name)},
                            {"answered", answers[i].has_value()}};
    if (answers[i]) {
      out["done"] = answers[i]->outcome.done;
      out["detail"] = print::utf8(answers[i]->outcome.detail);
      out["after_ms"] = std::chrono::duration<double, std::milli>(answers[i]->after).count();
    }
    all.push_back(std::move(out));
  }
  return all;
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
  const auto is_pending = [&key](const fabric::plant::Plant& seen) {
    const auto found = seen.channels().find(key);
    return found != seen.channels().end() && found->second.call != fabric::CallId{};
  };
  // A gateway that has just taken the channel over first publishes the call of its journal.
  const auto is_enough = [&](const fabric::plant::Plant& seen) {
    return is_pending(seen) &&
           seen.channels().find(key)->second.state != fabric::ChannelState::link_down;
  };
  fabric::plant::Plant live = bus::take_snapshot(options.fabric.options(), {}, is_enough);
  if (!live.channels().contains(key)) {
    // On a busy host its gateway may be discovered later than the first processes.
    live = bus::take_snapshot(options.fabric.options(), {.at_least = std::chrono::seconds(3)},
                              is_enough);
  }
  const auto channel = live.channels().find(key);
  if (!is_pending(live)) {
    const std::string flags = fabric::profile::given_flags(options.fabric);
    if (channel != live.channels().end() &&
        channel->second.state == fabric::ChannelState::unserved) {
      // The gateway writes nothing to such a channel: docs/explanation/life-of-a-call.md.
      fmt::print(stderr,
                 "millrace: the request of {} has no service: {}. Only a call that the gateway has "
                 "accepted can be answered or retried: start the service, or correct the NC "
                 "program and reset it; 'millrace services{}' shows the services\n",
                 key.to_string(), base::text::safe(channel->second.reason.text), flags);
    } else if (!live.has_gateway()) {
      print_why_no_gateway(live, flags);
    } else {
      fmt::print(stderr, "millrace: no call is pending in {}; 'millrace channels{}' shows them\n",
                 key.to_string(), flags);
    }
    return program::exit_failed;
  }
  command.key = key;
  command.call = channel->second.call;
  fabric::dds::Participant participant(options.fabric.options());
  const auto outcomes = bus::issue(participant, {command}, patience_of(options),
                                   fabric::profile::given_flags(options.fabric));
  const auto word = outcomes.find(command.id);
  if (word == outcomes.end()) {
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
               result_text(command.kind, outcome));
  }
  return outcome.done ? program::exit_done : program::exit_failed;
}

}  // namespace millrace::tools::commands::operate
