// millrace programs: starts, ends and aborts of the NC programs of machines.
#include <map>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/data/data.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::data {

namespace {

namespace program = base::program;
using fabric::ProgramEvent;
using fabric::ProgramEventKind;

using Last = std::map<fabric::ChannelKey, recording::Entry>;

const ProgramEvent* event_for(const DataOptions& options, const recording::Entry& entry) {
  const auto* event = std::get_if<ProgramEvent>(&entry.sample);
  return event != nullptr && options.takes(event->key) ? event : nullptr;
}

std::string lasted(const ProgramEvent& event) {
  const bool known = event.started != fabric::Time{} && event.kind != ProgramEventKind::started;
  return known ? print::duration_text(event.at - event.started) : "-";
}

void show_table(const Last& last) {
  print::Table table({{"CHANNEL"},
                      {"LAST"},
                      {"SINCE", print::Align::right},
                      {"PROGRAM"},
                      {"LASTED", print::Align::right},
                      {"ERROR", print::Align::right},
                      {"PARTS", print::Align::right},
                      {"MODE"},
                      {"WHY"}});
  for (const auto& [key, entry] : last) {
    const auto& event = std::get<ProgramEvent>(entry.sample);
    table.add({base::text::safe(key.to_string()), std::string(fabric::name_of(event.kind)),
               ago(event.at), event.program.empty() ? "-" : base::text::quoted(event.program),
               lasted(event), event.error != 0 ? std::to_string(event.error) : "-",
               event.parts ? std::to_string(*event.parts) : "-", print::mode_text(event.mode),
               why(event.detail, event.replayed)});
  }
  fmt::print("{}", table.text());
}

int show_once(const DataOptions& options) {
  Last last;
  listen(options, [&](const recording::Entry& entry) {
    if (const ProgramEvent* event = event_for(options, entry)) {
      last.insert_or_assign(event->key, entry);
    }
    return true;
  });
  if (last.empty() && !options.machine.empty()) {
    return report_unknown_machine(options);
  }
  if (options.json) {
    boost::json::array out;
    for (const auto& [key, entry] : last) {
      out.push_back(print::json_of(entry));
    }
    print::print_json(out);
  } else if (last.empty()) {
    fmt::print(
        "no gateway on fabric '{}', domain {}, has published an NC program; programs {{ }} in its "
        "configuration lists the channels that it watches\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    show_table(last);
  }
  return program::exit_done;
}

}  // namespace

void add_programs(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "programs",
      "Starts, ends and aborts of NC programs: the last event of each channel, or all as they come",
      "millrace programs press --watch");
  auto options = std::make_shared<DataOptions>(command, "event");
  command.callback([options, &chosen] {
    chosen.run = [options] {
      if (!options->watch) {
        return show_once(*options);
      }
      return follow(*options, [options](const recording::Entry& entry) {
        return event_for(*options, entry) != nullptr;
      });
    };
  });
}

}  // namespace millrace::tools::commands::data
