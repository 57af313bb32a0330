#include "tools/commands/vars/vars.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/commands/arguments.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;
using cnc::ads::ErrorCode;

constexpr std::uint32_t last_channel = 255;

std::string advice_on(const VarsOptions& options, ErrorCode error) {
  switch (error) {
    case ErrorCode::symbol_not_found:
    case ErrorCode::not_found:
    case ErrorCode::invalid_data:
      return fmt::format("; 'millrace vars {} list{}' shows the variables", *options.machine,
                         fabric::profile::given_flags(options.fabric));
    case ErrorCode::invalid_group:
      return fmt::format("; does the controller have a channel {}?", options.channel);
    case ErrorCode::link_lost:
      return "; did another ADS client on this host connect, for example a gateway?";
    default:
      return "";
  }
}

}  // namespace

VarsOptions::VarsOptions(CLI::App& command, Machine the_machine)
    : fabric(command, {.name = "millrace"}), machine(std::move(the_machine)) {
  command.add_flag("--direct", direct,
                   "Ask the controller itself over ADS, without gateway and fabric");
  command
      .add_option("--config", config,
                  "With --direct: the gateway's configuration, with the address of MACHINE")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  command.add_option("--channel", channel, "Channel of the controller, counted from 1")
      ->check(CLI::Range(1U, last_channel))
      ->capture_default_str();
  add_duration(command, "--timeout", timeout,
               "Wait for the gateway's response for this time; default 5s");
}

std::string VarsOptions::name() const {
  return machine->substr(0, machine->find('='));
}

int with_source(const VarsOptions& options, const std::function<int(Source&)>& work) {
  if (!options.direct) {
    return work(*gateway(options));
  }
  const auto source = controller(options);
  if (!source) {
    fmt::print(stderr, "millrace: {}\n", source.error().what);
    return program::exit_failed;
  }
  return work(**source);
}

void print_failure(const VarsOptions& options, const Failure& failure) {
  fmt::print(stderr, "millrace: {}, channel {}: {}{}\n", base::text::safe(options.name()),
             options.channel, base::text::safe(failure.what), advice_on(options, failure.error));
}

tl::expected<std::vector<std::string>, Failure> controller_texts(const NewValue& value) {
  std::vector<std::string> texts;
  for (const std::string& element : value.values) {
    auto text = base::text::to_cp1252(element);
    if (!text) {
      return tl::unexpected(
          Failure{fmt::format("{} is not written: the value cannot be sent to a controller: {}",
                              value.name, text.error())});
    }
    texts.push_back(std::move(*text));
  }
  return texts;
}

void add_vars(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "vars", "The variables of a controller, through its gateway",
      "millrace vars press read V.G.BLOCK_NR V.A.ACT_POS.X\n"
      "  millrace vars cnc list --family V.G\n"
      "  millrace vars press read V.E.LIMIT --direct --config gateway.textproto\n\n"
      "The gateway asks the controller over the connection that it has, and lets nothing be "
      "written\n"
      "but what its configuration names. With --direct the controller is asked past it: a TwinCAT\n"
      "router keeps one connection per host, the newest, so on the host of a gateway that takes "
      "the\n"
      "gateway's link away for a moment.");
  const auto machine = std::make_shared<std::string>();
  command
      .add_option("MACHINE", *machine,
                  "Name of a machine. With --direct: a machine of --config; or "
                  "NAME=HOST:PORT/NETID; or cnc, the virtual CNC on this host")
      ->required();
  command.require_subcommand(1);
  add_list(command, machine, chosen);
  add_read(command, machine, chosen);
  add_write(command, machine, chosen);
}

}  // namespace millrace::tools::commands::vars
