#include "gateway/live/plant_variables.hpp"

#include <utility>

#include "gateway/words.hpp"

namespace millrace::gateway::live {

PlantVariables::PlantVariables(boost::asio::any_io_executor executor,
                               const fabric::dds::Participant& participant,
                               std::function<Moment()> now, Outlet outlet, base::program::Log log)
    : executor_(std::move(executor)),
      now_(std::move(now)),
      outlet_(std::move(outlet)),
      log_(std::move(log)),
      end_(participant, executor_, [this](const auto& request) { on_request(request); }) {}

PlantVariables::Machine& PlantVariables::machine(const std::string& name) {
  Machine& one = machines_[name];
  if (!one.variables) {
    one.variables = std::make_unique<MachineVariables>(
        executor_, name, settings_[name], now_,
        VariableOutlet{
            .answer = [this](const auto& asker, const auto& reply) { answer(asker, reply); },
            .written = outlet_.written},
        log_);
  }
  return one;
}

void PlantVariables::set(const std::vector<settings::MachineSettings>& machines) {
  for (const settings::MachineSettings& settings : machines) {
    settings_[settings.name] = settings.variables;
    machine(settings.name).variables->change(settings.variables);
  }
}

void PlantVariables::connect(const std::string& name, std::weak_ptr<cnc::ads::Client> client,
                             std::weak_ptr<const cnc::variables::Location> location) {
  machine(name).variables->connect(std::move(client), std::move(location));
}

void PlantVariables::on_up(const std::string& name, const std::vector<std::uint16_t>& channels) {
  Machine& one = machine(name);
  one.channels.insert(channels.begin(), channels.end());
  one.down = false;
  one.variables->on_up(channels);
}

void PlantVariables::on_down(const std::string& name, const std::string& reason) {
  Machine& one = machine(name);
  one.down = true;
  one.variables->on_down(reason);
}

void PlantVariables::on_dropped(const std::string& name) {
  Machine& one = machine(name);
  one.channels.clear();
  one.down = false;
  one.variables->on_over(0);
}

void PlantVariables::on_over(const fabric::ChannelKey& key) {
  Machine& one = machine(key.machine);
  one.channels.erase(key.channel);
  one.variables->on_over(key.channel);
}

void PlantVariables::on_request(const fabric::VariableRequest& request) {
  outlet_.begin_event();
  const auto found = machines_.find(request.key.machine);
  if (found == machines_.end()) {
    return;
  }
  const Machine& one = found->second;
  const bool never_up = one.down && one.channels.empty();
  if (never_up || one.channels.contains(request.key.channel)) {
    one.variables->on_request(request);
  }
}

void PlantVariables::answer(const fabric::InstanceId& asker, const fabric::VariableReply& reply) {
  if (const auto published = end_.publish(asker, reply); !published) {
    log_->warn("an answer about variables cannot be told: {}", printable(published.error()));
  }
}

}  // namespace millrace::gateway::live
