#include "base/program/command_line.hpp"
#include "base/program/command_tree.hpp"
#include "services/batch/catalog.hpp"
#include "services/batch/host.hpp"
#include "services/sdk/command_line.hpp"

namespace millrace::services::batch {

namespace {

struct Flags {
  std::string program;
  std::uint32_t time_limit_ms = 30000;
  bool accept_empty = false;
  bool cut = false;
  bool cp1252 = false;
};

void add_flags(CLI::App& app, Flags& flags) {
  app.add_option("--exec", flags.program, "Program to run for each call")->required();
  app.add_option("--time-limit", flags.time_limit_ms, "Longest run time in milliseconds")
      ->check(base::program::positive_number())
      ->capture_default_str();
  app.add_flag("--accept-empty", flags.accept_empty, "Also run it for an empty request");
  app.add_flag("--cut", flags.cut, "Answer with the first 127 bytes of longer output");
  app.add_flag("--cp1252", flags.cp1252, "The program uses the controller's code page, not UTF-8");
}

/// Throws UsageError for a missing file: without --config, no check would notice it later.
Script script_from(const Flags& flags, const sdk::ServiceOptions& options) {
  Script script;
  script.registration.name = options.name;
  script.program = std::filesystem::absolute(flags.program).lexically_normal();
  script.folder = std::filesystem::current_path();
  script.time_limit = std::chrono::milliseconds(flags.time_limit_ms);
  script.too_long = flags.cut ? TooLong::cut : TooLong::refuse;
  script.encoding = flags.cp1252 ? Encoding::cp1252 : Encoding::utf8;
  script.accept_empty = flags.accept_empty;
  if (present({script}).empty()) {
    throw base::program::UsageError("--exec: " + script.program.string() +
                                    " is missing or not executable");
  }
  return script;
}

}  // namespace

namespace {

sdk::ServiceOptions defaults() {
  return {.name = "batch",
          .description = "Answers calls with a program",
          .version = MILLRACE_VERSION,
          .delivery = fabric::Delivery::at_most_once};
}

}  // namespace

void tell_flags_of_one(CLI::App& others) {
  sdk::ServiceProgram program(defaults());
  Flags flags;
  add_flags(program.app(), flags);
  for (const base::program::CommandOption& option :
       base::program::command_tree(program.app(), "").options) {
    if (option.names.empty() || others.get_option_no_throw(option.names.front()) != nullptr) {
      continue;
    }
    const std::string name = option.names.front();
    const auto refuse = [name] { throw CLI::ValidationError(name, "needs --exec PROGRAM"); };
    const std::string description = "With --exec: " + option.description;
    CLI::Option* const told =
        option.value.empty()
            ? others.add_flag_callback(name, refuse, description)
            : others
                  .add_option_function<std::string>(
                      name, [refuse](const std::string&) { refuse(); }, description)
                  ->type_name(option.value);
    told->group("One program without a file");
  }
}

int serve_one(int argc, char** argv) {
  sdk::ServiceProgram program(defaults());
  Flags flags;
  add_flags(program.app(), flags);
  const std::function<sdk::Handler()> make = [&] {
    return answering(std::make_shared<CurrentScript>(script_from(flags, program.options())),
                     program.log());
  };
  return program.run(argc, argv, make);
}

}  // namespace millrace::services::batch
