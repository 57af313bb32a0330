// millrace log ls: the channels of a recording.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "tools/commands/log/log.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::log {

namespace {

struct LsOptions {
  std::filesystem::path file;
  bool json = false;
};

struct Row {
  std::string topic;
  std::string schema;
  std::uint64_t messages = 0;
};

std::vector<Row> rows_of(const mcap::Summary& summary) {
  std::vector<Row> rows;
  for (const auto& [id, channel] : summary.definitions.channels()) {
    const mcap::Schema* schema = summary.definitions.schema(channel.schema);
    const auto count = summary.statistics.channel_messages.find(id);
    rows.push_back({print::utf8(channel.topic), schema != nullptr ? print::utf8(schema->name) : "-",
                    count != summary.statistics.channel_messages.end() ? count->second : 0});
  }
  return rows;
}

int list(const LsOptions& options) {
  mcap::FileSource source = open(options.file);
  const mcap::Survey survey = mcap::survey(source);
  if (options.json) {
    boost::json::array out;
    for (const Row& row : rows_of(survey.summary)) {
      out.push_back({{"topic", row.topic}, {"schema", row.schema}, {"messages", row.messages}});
    }
    print::print_json(out);
  } else {
    print::Table table({{"TOPIC"}, {"MESSAGES", print::Align::right}, {"SCHEMA"}});
    for (const Row& row : rows_of(survey.summary)) {
      table.add({row.topic, std::to_string(row.messages), row.schema});
    }
    fmt::print("{}", table.text());
  }
  return report(options.file, survey.problems);
}

}  // namespace

void add_ls(CLI::App& log, Chosen& chosen) {
  auto options = std::make_shared<LsOptions>();
  CLI::App& command =
      add_subcommand(log, "ls", "The MCAP channels of a recording, with their message counts",
                     "millrace log ls run.mcap");
  add_file(command, options->file);
  add_json(command, options->json);
  command.callback([options, &chosen] { chosen.run = [options] { return list(*options); }; });
}

}  // namespace millrace::tools::commands::log
