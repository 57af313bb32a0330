#include "gateway/shell/check_controllers.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "base/program/barrier.hpp"
#include "cnc/variables/readings.hpp"
#include "gateway/settings/client_options.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;

asio::awaitable<void> ask(const settings::MachineSettings& machine, cnc::ads::Client& client,
                          ControllerCheck& asked) {
  const auto connected = co_await client.connect();
  if (!connected) {
    asked.silent.push_back(
        fmt::format("{}: {}", machine.to_string(), connected.error().message.text));
    co_return;
  }
  cnc::variables::Readings readings(client);
  std::vector<data::GroupSettings> groups = machine.data.groups;
  for (const programs::ProgramSettings& settings : machine.programs) {
    groups.push_back(programs::group_of(settings));
  }
  for (const data::GroupSettings& group : groups) {
    const auto known = co_await readings.look_up(group.channel, group.names);
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!known[i]) {
        asked.mistakes.push_back(fmt::format("{}/{}: data {}: {}: {}", machine.name, group.channel,
                                             group.name, group.names[i], known[i].error().reason));
      }
    }
  }
  client.close();
}

}  // namespace

ControllerCheck check_controllers(const std::vector<settings::MachineSettings>& machines) {
  ControllerCheck asked;
  for (const settings::MachineSettings& machine : machines) {
    if (machine.data.groups.empty() && machine.programs.empty()) {
      continue;
    }
    asio::io_context io(1);
    cnc::ads::Client client(io.get_executor(), client_options(machine));
    asio::co_spawn(io, ask(machine, client, asked), base::program::rethrow_from_loop);
    io.run();
  }
  return asked;
}

}  // namespace millrace::gateway::shell
