// How a subcommand joins the command line: it describes itself and stores the function to run if it
// is chosen.
//
//   void add_ls(CLI::App& log, Chosen& chosen) {
//     auto options = std::make_shared<Options>();
//     CLI::App& ls = add_subcommand(log, "ls", "What is recorded", "millrace log ls run.mcap");
//     ls.add_option(…, options->file);
//     ls.callback([options, &chosen] { chosen.run = [options] { return list(*options); }; });
//   }
#pragma once

#include <functional>
#include <string>

#include <CLI/App.hpp>

namespace millrace::tools::commands {

/// The function that main runs after the command line was read; returns the exit code.
struct Chosen {
  std::function<int()> run;
};

/// Adds a subcommand whose help ends with an example.
CLI::App& add_subcommand(CLI::App& parent, const std::string& name, const std::string& description,
                         const std::string& example);

/// Adds `--json`.
void add_json(CLI::App& command, bool& json);

}  // namespace millrace::tools::commands
