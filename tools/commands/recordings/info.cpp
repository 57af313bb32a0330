// millrace recording info: what a recording holds, from its summary.
#include <fmt/format.h>

#include "tools/commands/recordings/recordings.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/print/json.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct InfoOptions {
  std::filesystem::path file;
  bool hops = false;
  bool json = false;
};

int info(const InfoOptions& options) {
  mcap::FileSource source = open(options.file);
  const mcap::Survey survey = recording::survey(source);
  recording::HopStatistics hops;
  if (options.hops) {
    recording::read_entries(source, {}, [&](const recording::Entry& entry) { hops.add(entry); });
    hops.close();
  }
  if (options.json) {
    boost::json::object out = print::json_of(source.size(), survey);
    if (options.hops) {
      out["hops"] = print::hops_json(hops);
    }
    print::print_json(out);
  } else {
    fmt::print("{}{}", print::text_of(options.file.string(), source.size(), survey),
               options.hops ? '\n' + print::hops_text(hops) : "");
  }
  return report(options.file, survey.problems,
                survey.summary.statistics.messages > 0 || !survey.metadata.empty());
}

}  // namespace

void add_info(CLI::App& recording, Chosen& chosen) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App& command =
      add_subcommand(recording, "info", "What a recording holds; reads its summary only",
                     "millrace recording info --hops run.mcap");
  add_file(command, options->file);
  command.add_flag("--hops", options->hops,
                   "Also p50, p99 and maximum of each hop and service; reads the whole file");
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, info);
}

}  // namespace millrace::tools::commands::recordings
