// millrace queues: the message queues of controllers, and their read positions.
#include <map>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/data.hpp"
#include "tools/commands/data/data.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::data {

namespace {

namespace program = base::program;
using fabric::DataSample;

using Queues = std::map<fabric::ChannelKey, recording::Entry>;

const DataSample* queue_for(const DataOptions& options, const recording::Entry& entry) {
  const auto* sample = std::get_if<DataSample>(&entry.sample);
  if (sample == nullptr || !fabric::is_queue(*sample)) {
    return nullptr;
  }
  const std::string machine(fabric::machine_of(sample->key.machine));
  const bool wanted = options.takes(sample->key) || options.takes({machine, sample->key.channel});
  return wanted ? sample : nullptr;
}

/// The numbers of a sample; it comes from another process and may be incomplete.
struct Numbers {
  explicit Numbers(const DataSample& from) : sample(from) {}

  [[nodiscard]] std::string text(std::string_view name) const {
    const fabric::Value* const value = fabric::value_of(sample, name);
    const auto* texts =
        value == nullptr ? nullptr : std::get_if<std::vector<std::string>>(&value->elements);
    return texts == nullptr || texts->empty() ? "-" : base::text::safe(texts->front());
  }
  [[nodiscard]] std::int64_t number(std::string_view name) const {
    return fabric::number_of(sample, name).value_or(0);
  }
  /// "3 of 99": messages in the controller.
  [[nodiscard]] std::string filled() const {
    const auto filled = fabric::filled_of(sample);
    return filled ? fmt::format("{} of {}", filled->messages, filled->room) : "-";
  }
  /// Why it is not read.
  [[nodiscard]] std::string trouble() const {
    const fabric::Value* const value = fabric::value_of(sample, "last_filled");
    return value == nullptr ? "" : base::text::safe(value->reason);
  }

  const DataSample& sample;
};

void show_queues(const Queues& queues) {
  print::Table table({{"QUEUE"},
                      {"ARRAY"},
                      {"FILLED", print::Align::right},
                      {"LAST GET", print::Align::right},
                      {"LAST FILLED", print::Align::right},
                      {"READ", print::Align::right},
                      {"WAITING", print::Align::right},
                      {"ANSWERED", print::Align::right},
                      {"DRAIN"},
                      {"UUID"},
                      {"WHY"}});
  for (const auto& [key, entry] : queues) {
    const Numbers of(std::get<DataSample>(entry.sample));
    table.add({base::text::safe(key.to_string()), of.text("array"), of.filled(),
               std::to_string(of.number("last_get")), std::to_string(of.number("last_filled")),
               std::to_string(of.number("messages")), std::to_string(of.number("waiting")),
               std::to_string(of.number("answered")), of.text("drain"), of.text("uuid"),
               why(of.trouble(), of.sample.replayed)});
  }
  fmt::print("{}", table.text());
}

int show_queues_once(const DataOptions& options) {
  Queues queues;
  listen(options, [&](const recording::Entry& entry) {
    if (const DataSample* sample = queue_for(options, entry)) {
      if (sample->values.empty()) {
        queues.erase(sample->key);
      } else {
        queues.insert_or_assign(sample->key, entry);
      }
    }
    return true;
  });
  if (queues.empty() && !options.machine.empty()) {
    return report_unknown_machine(options);
  }
  if (options.json) {
    boost::json::array out;
    for (const auto& [key, entry] : queues) {
      out.push_back(print::json_of(entry));
    }
    print::print_json(out);
  } else if (queues.empty()) {
    fmt::print(
        "no gateway on fabric '{}', domain {}, reads such a queue; queue {{ }} in the machine of "
        "its configuration lists the queues that it reads\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    show_queues(queues);
  }
  return program::exit_done;
}

}  // namespace

void add_queues(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "queues", "Message queues of controllers, and their read positions",
                     "millrace queues press\n"
                     "  millrace queues --watch --json");
  auto options = std::make_shared<DataOptions>(command, "change");
  command.callback([options, &chosen] {
    chosen.run = [options] {
      if (!options->watch) {
        return show_queues_once(*options);
      }
      return follow(*options, [options](const recording::Entry& entry) {
        return queue_for(*options, entry) != nullptr;
      });
    };
  });
}

}  // namespace millrace::tools::commands::data
