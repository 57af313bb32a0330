// millrace calls: the last calls, one call over every hop, or the calls as they end.
#include "tools/commands/calls/calls.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/calls/call_list.hpp"
#include "tools/commands/names.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/recording/timeline.hpp"

namespace millrace::tools::commands::calls {

namespace {

/// Unless --count says otherwise.
constexpr std::uint64_t listed = 20;

/// All that is still on the fabric of calls, and what comes while it listens.
void listen(const CallsOptions& options,
            const std::function<void(const recording::Entry&)>& on_entry) {
  bus::listen(options.fabric.options(), bus::patience_of(options.wait),
              fabric::observer::Interest::everything, on_entry);
}

int list(const CallsOptions& options) {
  CallList calls(options.count.value_or(listed));
  Names machines;
  listen(options, [&](const recording::Entry& entry) {
    if (const auto* status = std::get_if<fabric::MachineStatus>(&entry.sample)) {
      machines.push_back(status->machine);
    }
    if (std::holds_alternative<recording::InstanceNews>(entry.sample) ||
        options.filter.takes(entry)) {
      calls.add(entry);
    }
  });
  const std::vector<CallRow> rows = calls.rows();
  for (const std::string& machine : options.filter.machines) {
    if (rows.empty() && std::ranges::find(machines, machine) == machines.end()) {
      return print_unknown("machine", machine, machines, options.fabric.options());
    }
  }
  if (rows.empty() && options.output.is_text()) {
    fmt::print("no call is known on fabric '{}', domain {}; 'millrace calls -f{}' follows them\n",
               options.fabric.options().fabric, options.fabric.options().domain,
               fabric::profile::given_flags(options.fabric));
  } else {
    print_listing(listing(), rows, options.output);
  }
  return base::program::exit_done;
}

int show(const CallsOptions& options) {
  const auto id = fabric::parse_call_id(options.call);
  recording::Call call(id.value_or(fabric::CallId{}));
  CallList others(listed);
  listen(options, [&](const recording::Entry& entry) {
    call.add(entry);
    others.add(entry);
  });
  const recording::Timeline timeline = recording::timeline_of(call);
  if (!id || timeline.steps.empty()) {
    Names known;
    for (const CallRow& row : others.rows()) {
      known.push_back(row.call.id.to_string());
    }
    const int code = print_unknown("call", options.call, known, options.fabric.options());
    if (id) {
      fmt::print(stderr, "millrace: 'millrace recording calls FILE {}' finds it in a recording\n",
                 options.call);
    }
    return code;
  }
  if (options.output.json) {
    print::print_json(print::json_of(timeline));
  } else {
    fmt::print("{}", print::text_of(timeline));
  }
  return base::program::exit_done;
}

}  // namespace

CallsOptions::CallsOptions(CLI::App& command)
    : fabric(command, {.name = "millrace calls"}), output(command), wait(bus::Patience{}.at_least) {
  output.exclude(
      command.add_option("CALL", call, "Only this call, with each step that is still known"));
  output.exclude(command.add_flag("-f,--follow", follow,
                                  "Each call when it ends; on a terminal a table of rates"));
  add_filter(command, filter);
  command
      .add_option("--count", count,
                  "The last COUNT calls; default 20. With -f: end after COUNT calls")
      ->check(base::program::positive_number());
  command.add_flag("--lines", lines, "With -f: lines on a terminal, too");
  add_duration(command, "--wait", wait, "Without -f: listen for at least this time; default 700ms");
}

void add_calls(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "calls", "The last calls, one call with each step, or calls as they end",
                     "millrace calls\n"
                     "  millrace calls 5f3a9c0112d4-17\n"
                     "  millrace calls -f --channel 1\n"
                     "  millrace calls -f --json --count 100 | jq .duration_ms");
  auto options = std::make_shared<CallsOptions>(command);
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    return wanted.follow ? follow(wanted) : wanted.call.empty() ? list(wanted) : show(wanted);
  });
}

}  // namespace millrace::tools::commands::calls
