// millrace data: the values that gateways sample.
#include "tools/commands/data/data.hpp"

#include <map>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/data/listen.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::data {

namespace {

namespace program = base::program;
using fabric::DataSample;

struct Options : DataOptions {
  explicit Options(CLI::App& command) : DataOptions(command, "sample") {
    command.add_option("--group", groups, "Only this group; may be repeated")
        ->allow_extra_args(false);
  }

  std::vector<std::string> groups;
};

/// By channel and group.
using Samples = std::map<std::pair<fabric::ChannelKey, std::string>, recording::Entry>;

const DataSample* sample_for(const Options& options, const recording::Entry& entry) {
  const auto* sample = std::get_if<DataSample>(&entry.sample);
  const bool wanted = sample != nullptr && options.takes(sample->key) &&
                      (options.groups.empty() ||
                       std::ranges::find(options.groups, sample->group) != options.groups.end());
  return wanted ? sample : nullptr;
}

/// "100 ms", and the configured period if it differs.
std::string period_text(const DataSample& sample) {
  return sample.period == sample.wanted
             ? print::duration_text(sample.wanted)
             : fmt::format("{} (not {})", print::duration_text(sample.period),
                           print::duration_text(sample.wanted));
}

void show_table(const Samples& samples) {
  print::Table table({{"CHANNEL"},
                      {"GROUP"},
                      {"EVERY", print::Align::right},
                      {"VARIABLE"},
                      {"TYPE"},
                      {"VALUE"},
                      {"QUALITY"},
                      {"READ", print::Align::right},
                      {"WHY"}});
  for (const auto& [key, entry] : samples) {
    const auto& sample = std::get<DataSample>(entry.sample);
    for (const fabric::Value& value : sample.values) {
      table.add({base::text::safe(sample.key.to_string()), base::text::safe(sample.group),
                 period_text(sample), base::text::safe(value.name),
                 std::string(fabric::name_of(value.type)), print::text_of(value),
                 std::string(fabric::name_of(value.quality)), ago(value.at),
                 why(value.reason, sample.replayed)});
    }
  }
  fmt::print("{}", table.text());
}

int show_once(const Options& options) {
  Samples samples;
  listen(options, [&](const recording::Entry& entry) {
    if (const DataSample* sample = sample_for(options, entry)) {
      if (sample->values.empty()) {
        samples.erase({sample->key, sample->group});
      } else {
        samples.insert_or_assign({sample->key, sample->group}, entry);
      }
    }
    return true;
  });
  if (samples.empty() && !options.machine.empty()) {
    return say_unknown_machine(options);
  }
  if (options.json) {
    boost::json::array out;
    for (const auto& [key, entry] : samples) {
      out.push_back(print::json_of(entry));
    }
    print::print_json(out);
  } else if (samples.empty()) {
    fmt::print(
        "no gateway on fabric '{}', domain {}, publishes such data; data {{ }} in its "
        "configuration lists what it samples\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    show_table(samples);
  }
  return program::exit_done;
}

}  // namespace

void add_data(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "data", "Values of machines, as gateways sample them",
                     "millrace data press\n"
                     "  millrace data press --group axes --watch --json | jq .values[0].value");
  auto options = std::make_shared<Options>(command);
  command.callback([options, &chosen] {
    chosen.run = [options] {
      if (!options->watch) {
        return show_once(*options);
      }
      return follow(*options, [options](const recording::Entry& entry) {
        return sample_for(*options, entry) != nullptr;
      });
    };
  });
}

}  // namespace millrace::tools::commands::data
