// Answers questions about the variables of one machine: carries out what its desk decides, over the
// machine's own link, and never while a call has a request there, unless that takes long.
//
//   MachineVariables variables(executor, "press", settings, now, outlet, log);
//   variables.connect(link.client(), link.location());
//   variables.on_up({1, 2});
//   variables.on_request(request);                → outlet.answer(asker, reply)
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/channel.hpp"
#include "gateway/variables/desk.hpp"

namespace millrace::gateway::live {

/// Where answers go.
struct VariableOutlet {
  std::function<void(const fabric::InstanceId& asker, const fabric::VariableReply&)> answer;
  /// What became of a variable that was to be written.
  std::function<void(const variables::News::Written&)> written;
};

class MachineVariables {
 public:
  MachineVariables(boost::asio::any_io_executor executor, std::string machine,
                   const variables::VariableSettings& settings, std::function<Moment()> now,
                   VariableOutlet outlet, base::program::Log log);
  ~MachineVariables();
  MachineVariables(const MachineVariables&) = delete;
  MachineVariables& operator=(const MachineVariables&) = delete;

  void change(const variables::VariableSettings& settings);
  /// A new link: what is asked from now on, is asked there. `location` says where the controller
  /// keeps its variables, once it is up.
  void connect(std::weak_ptr<cnc::ads::Client> client,
               std::weak_ptr<const cnc::variables::Location> location);
  /// The link is up, and these of its channels are served; also when there are more. To be told
  /// before anything is asked of the link.
  void on_up(const std::vector<std::uint16_t>& channels);
  void on_down(const std::string& reason);
  /// The channel is not ours any more; 0 = none is.
  void on_over(std::uint16_t channel);
  void on_request(const fabric::VariableRequest& request);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::gateway::live
