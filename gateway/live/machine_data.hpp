// Samples the data of one machine: carries out what its sampler decides, over the machine's own
// link, and never while a call has a request there, unless that takes long.
//
//   MachineData data(executor, "press", settings.data, now, publish, log);
//   data.connect(link.client());
//   data.on_up({1, 2});                   → publish.sample(…) on each beat
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/channel.hpp"
#include "gateway/data/sampler.hpp"

namespace millrace::gateway::live {

/// Where samples go.
struct DataOutlet {
  std::function<void(const fabric::DataSample&)> publish;
  std::function<void(const fabric::DataSample&)> let_go;
};

class MachineData {
 public:
  MachineData(boost::asio::any_io_executor executor, std::string machine,
              const data::DataSettings& settings, std::function<Moment()> now, DataOutlet outlet,
              base::program::Log log);
  ~MachineData();
  MachineData(const MachineData&) = delete;
  MachineData& operator=(const MachineData&) = delete;

  /// A new link: what is asked from now on, is asked there. `location` says where the controller
  /// keeps its variables, once the link is up; without it, at the vendor's defaults.
  void connect(std::weak_ptr<cnc::ads::Client> client,
               std::weak_ptr<const cnc::variables::Location> location = {});
  /// The link is up, and these of its channels are served; also when there are more. To be told
  /// before anything is asked of the link.
  void on_up(const std::vector<std::uint16_t>& channels);
  void on_down();
  /// The channel is not ours any more; 0 = none is.
  void on_over(std::uint16_t channel);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::gateway::live
