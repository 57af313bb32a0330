// How a subcommand joins the command line: it describes itself and stores the function to run if it
// is chosen.
//
//   void add_cat(CLI::App& recording, Chosen& chosen) {
//     auto options = std::make_shared<Options>();
//     CLI::App& cat = add_subcommand(recording, "cat", "Its entries", "millrace recording cat FILE");
//     cat.add_option(…, options->file);
//     run_if_chosen(cat, chosen, options, print);
//   }
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

#include "gateway/settings/settings.hpp"

namespace millrace::tools::commands {

/// The function that main runs after the command line was read; returns the exit code.
struct Chosen {
  std::function<int()> run;
};

/// Adds a subcommand whose help ends with an example.
CLI::App& add_subcommand(CLI::App& parent, const std::string& name, const std::string& description,
                         const std::string& example);

/// Chooses `run`, a function of the options, once the command was parsed.
template <typename Options, typename Run>
void run_if_chosen(CLI::App& command, Chosen& chosen, std::shared_ptr<Options> options, Run run) {
  command.callback([options = std::move(options), run, &chosen] {
    chosen.run = [options, run] { return run(*options); };
  });
}

/// Adds `--json`.
void add_json(CLI::App& command, bool& json);

// `millrace completion`: a script with which a shell completes subcommands and options.

/// Describes the command line `app`, so it is added last.
void add_completion(CLI::App& app, Chosen& chosen);

// The order of words on the command line. Pure.

/// Moves global options behind the command, where it takes them:
/// "--domain 7 services" is "services --domain 7". "vars list press" is "vars press list". Without
/// a command: `status`. "help services" is "services --help", "version" is "--version".
std::vector<std::string> word_order(std::vector<std::string> words);

// The writer's name in our files.

/// "millrace 1.0.0".
std::string library_name();

// The warning of a command before it connects to a controller over ADS.

/// One connection per host is a rule of TwinCAT's router. The warning goes to standard error,
/// unless the controller is on this host and therefore a virtual one.
void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine);

}  // namespace millrace::tools::commands
