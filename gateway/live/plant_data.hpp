// The data of all machines: who samples them, and where they are told.
//
//   PlantData data(executor, participant, now, log);
//   data.set(settings.machines);                    // again when the configuration changes
//   data.connect("press", link.client(), link.location());
//   data.on_up("press", {1, 2});
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "fabric/ends/data_end.hpp"
#include "gateway/live/machine_data.hpp"
#include "gateway/programs/program_watch.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::live {

class PlantData {
 public:
  /// `participant` outlives it.
  PlantData(boost::asio::any_io_executor executor, const fabric::dds::Participant& participant,
            std::function<Moment()> now, base::program::Log log);

  void set(const std::vector<settings::MachineSettings>& machines);
  void connect(const std::string& machine, std::weak_ptr<cnc::ads::Client> client,
               std::weak_ptr<const cnc::variables::Location> location);
  void on_up(const std::string& machine, const std::vector<std::uint16_t>& channels);
  void on_down(const std::string& machine);
  /// The link was taken away.
  void on_dropped(const std::string& machine);
  /// The channel is not ours any more.
  void on_over(const fabric::ChannelKey& key);
  /// What else there is to tell beside machine data; without values that it is over.
  void publish_also(const fabric::DataSample& sample);

 private:
  struct Machine {
    data::DataSettings settings{};
    std::vector<programs::ProgramSettings> programs{};
    /// By channel.
    std::map<std::uint16_t, programs::ProgramWatch> watches{};
    std::weak_ptr<cnc::ads::Client> client{};
    std::weak_ptr<const cnc::variables::Location> location{};
    /// Those that are served, while the link is up.
    std::set<std::uint16_t> channels{};
    /// None where there is nothing to sample.
    std::unique_ptr<MachineData> data{};
  };

  void begin(const std::string& name, Machine& machine);
  [[nodiscard]] DataOutlet outlet();
  void publish(const fabric::DataSample& sample);
  void watch(const fabric::DataSample& sample);

  boost::asio::any_io_executor executor_;
  const fabric::dds::Participant& participant_;
  std::function<Moment()> now_;
  base::program::Log log_;
  /// Once there is something to tell: until then nobody on the fabric hears of these writers.
  std::optional<fabric::ends::DataEnd> end_;
  std::map<std::string, Machine> machines_;
};

}  // namespace millrace::gateway::live
