// How a subcommand joins the command line: it describes itself and stores the function to run if it
// is chosen.
//
//   void add_cat(CLI::App& recording, Chosen& chosen) {
//     auto options = std::make_shared<Options>();
//     CLI::App& cat = add_subcommand(recording, "cat", "Its entries", "millrace recording cat FILE");
//     cat.add_option(…, options->file);
//     cat.callback([options, &chosen] { chosen.run = [options] { return print(*options); }; });
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
