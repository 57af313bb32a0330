#include "tools/commands/vars/vars.hpp"

#include <algorithm>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "cnc/variables/listing.hpp"
#include "cnc/variables/type.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace asio = boost::asio;
namespace program = base::program;
using cnc::ads::ErrorCode;
using cnc::variables::Channel;

constexpr std::uint32_t last_channel = 255;

cnc::ads::ClientOptions client_options(const gateway::settings::MachineSettings& machine) {
  cnc::ads::ClientOptions options;
  options.host = machine.host;
  options.tcp_port = machine.tcp_port;
  options.target = machine.net_id;
  options.source.net_id = machine.source;
  return options;
}

/// One connection per host is a rule of TwinCAT's router; a controller on this host is a virtual
/// one.
void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine) {
  if (machine.host.starts_with("127.") || machine.host == "localhost") {
    return;
  }
  fmt::print(stderr,
             "millrace: a TwinCAT router keeps one connection per host, the newest: a gateway on "
             "this host loses its link to {} now and takes it back as soon as it can\n",
             machine.name);
}

asio::awaitable<int> connect_and(const gateway::settings::MachineSettings& machine,
                                 std::uint32_t number, cnc::ads::Client& client, const Work& work) {
  const auto up = co_await client.connect();
  if (!up) {
    fmt::print(stderr, "millrace: cannot reach {}: {}\n", machine.to_string(), up.error().message);
    co_return program::exit_failed;
  }
  Channel channel(client, number);
  const int exit_code = co_await work(channel);
  client.close();
  co_return exit_code;
}

std::string advice_on(const VarsOptions& options, ErrorCode error) {
  switch (error) {
    case ErrorCode::symbol_not_found:
    case ErrorCode::not_found:
    case ErrorCode::invalid_data:
      return fmt::format("; 'millrace vars {} list' shows what there is", *options.machine);
    case ErrorCode::invalid_group:
      return fmt::format("; has it a channel {}?", options.channel);
    case ErrorCode::link_lost:
      return "; has another ADS client on this host connected, a gateway for instance?";
    default:
      return "";
  }
}

}  // namespace

VarsOptions::VarsOptions(CLI::App& command, Machine the_machine) : machine(std::move(the_machine)) {
  command.add_option("--config", config, "The gateway's configuration, which names MACHINE")
      ->check(CLI::ExistingFile);
  command.add_option("--channel", channel, "Channel of the controller, counted from 1")
      ->check(CLI::Range(1U, last_channel))
      ->capture_default_str();
  add_json(command, json);
}

gateway::settings::MachineSettings machine_of(const VarsOptions& options) {
  const std::string& wanted = *options.machine;
  if (wanted.find('=') != std::string::npos) {
    return gateway::settings::parse_machine(wanted);
  }
  std::vector<gateway::settings::MachineSettings> known{gateway::settings::MachineSettings{}};
  if (!options.config.empty()) {
    known = gateway::settings::read_settings(options.config).machines;
  }
  const auto found = std::ranges::find(known, wanted, &gateway::settings::MachineSettings::name);
  if (found != known.end()) {
    return *found;
  }
  throw program::UsageError(
      options.config.empty()
          ? fmt::format("where is machine {}? Expected --config with the gateway's configuration, "
                        "or MACHINE as in {}=10.0.0.5:48898/10.0.0.5.1.1",
                        wanted, wanted)
          : fmt::format("{} names no machine {}", options.config.string(), wanted));
}

int on_channel(const VarsOptions& options, const Work& work) {
  const gateway::settings::MachineSettings machine = machine_of(options);
  warn_of_the_one_connection(machine);
  asio::io_context io(1);
  cnc::ads::Client client(io.get_executor(), client_options(machine));
  int exit_code = program::exit_failed;
  std::exception_ptr failure;
  asio::co_spawn(io, connect_and(machine, options.channel, client, work),
                 [&](std::exception_ptr error, int code) {
                   failure = error;
                   exit_code = code;
                   io.stop();
                 });
  io.run();
  if (failure) {
    std::rethrow_exception(failure);
  }
  return exit_code;
}

void complain(const VarsOptions& options, const std::string& what) {
  const std::string name = options.machine->substr(0, options.machine->find('='));
  fmt::print(stderr, "millrace: {}, channel {}: {}\n", name, options.channel, what);
}

void complain(const VarsOptions& options, const std::string& what, ErrorCode error) {
  complain(options,
           fmt::format("{}: {}{}", what, cnc::ads::describe(error), advice_on(options, error)));
}

asio::awaitable<std::optional<Reading>> read_one(const VarsOptions& options, Channel& channel,
                                                 std::string name) {
  using cnc::variables::max_stream;
  auto description = co_await cnc::variables::find(channel, name);
  if (!description) {
    complain(options, name, description.error());
    co_return std::nullopt;
  }
  const auto bytes = co_await channel.read(name, static_cast<std::uint32_t>(max_stream));
  if (!bytes) {
    complain(options, name, bytes.error());
    co_return std::nullopt;
  }
  const auto type = cnc::variables::element_type(*description);
  auto elements = type.and_then([&](const cnc::variables::ElementType& of) {
    return cnc::variables::decode_elements(of, *bytes);
  });
  if (!elements) {
    complain(options, fmt::format("{}: {}", name, elements.error()));
    co_return std::nullopt;
  }
  description->name = name;
  const bool is_array = !description->dimensions.empty() && name.find('[') == std::string::npos;
  co_return Reading{std::move(*description), *type, std::move(*elements), is_array};
}

void add_vars(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "vars", "The variables of a controller over ADS, past gateway and fabric",
      "millrace vars cnc list --family V.G\n"
      "  millrace vars press --config gateway.textproto read V.G.SERVICE.UUID\n\n"
      "A TwinCAT router keeps one connection per host, the newest. On the host of a gateway this\n"
      "command takes the gateway's link away for a moment; run it on another host that has a\n"
      "route. The virtual CNC takes any number of connections.");
  const auto machine = std::make_shared<std::string>();
  command
      .add_option("MACHINE", *machine,
                  "A machine of --config; or NAME=HOST:PORT/NETID; or cnc, the virtual CNC on this "
                  "host")
      ->required();
  command.require_subcommand(1);
  add_list(command, machine, chosen);
  add_read(command, machine, chosen);
  add_write(command, machine, chosen);
}

}  // namespace millrace::tools::commands::vars
