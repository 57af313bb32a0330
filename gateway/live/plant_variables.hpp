// Questions about variables of all machines: who answers them, and how the answers get out.
//
//   PlantVariables variables(executor, participant, now, {.written = …}, log);
//   variables.set(settings.machines);                    // again when the configuration changes
//   variables.connect("press", link.client(), link.location());
//   variables.on_up("press", {1, 2});
//
// Those of channels that this gateway serves are answered, and others are left to other gateways.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "fabric/ends/variable_end.hpp"
#include "gateway/live/machine_variables.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::live {

class PlantVariables {
 public:
  struct Outlet {
    /// An event begins.
    std::function<void()> begin_event;
    std::function<void(const variables::News::Written&)> written;
  };
  /// `participant` outlives it.
  PlantVariables(boost::asio::any_io_executor executor, const fabric::dds::Participant& participant,
                 std::function<Moment()> now, Outlet outlet, base::program::Log log);

  void set(const std::vector<settings::MachineSettings>& machines);
  void connect(const std::string& machine, std::weak_ptr<cnc::ads::Client> client,
               std::weak_ptr<const cnc::variables::Location> location);
  void on_up(const std::string& machine, const std::vector<std::uint16_t>& channels);
  void on_down(const std::string& machine, const std::string& reason);
  /// The link was taken away.
  void on_dropped(const std::string& machine);
  /// The channel is not ours any more.
  void on_over(const fabric::ChannelKey& key);

 private:
  struct Machine {
    std::unique_ptr<MachineVariables> variables{};
    /// Those that are served, also while the link is down.
    std::set<std::uint16_t> channels{};
    /// The link that is ours is down; of one that never was up it is not known which channels
    /// there are.
    bool down = false;
  };

  Machine& machine(const std::string& name);
  void on_request(const fabric::VariableRequest& request);
  void answer(const fabric::InstanceId& asker, const fabric::VariableReply& reply);

  boost::asio::any_io_executor executor_;
  std::function<Moment()> now_;
  Outlet outlet_;
  base::program::Log log_;
  std::map<std::string, Machine> machines_;
  /// What a machine is told of its variables before its configuration is known: nothing.
  std::map<std::string, variables::VariableSettings> settings_;
  /// The last, so that nobody asks one that is half made or half gone.
  fabric::ends::VariableAnswerEnd end_;
};

}  // namespace millrace::gateway::live
