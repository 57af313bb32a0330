#include "gateway/live/plant_data.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "gateway/words.hpp"

namespace millrace::gateway::live {

PlantData::PlantData(boost::asio::any_io_executor executor,
                     const fabric::dds::Participant& participant, std::function<Moment()> now,
                     base::program::Log log)
    : executor_(std::move(executor)),
      participant_(participant),
      now_(std::move(now)),
      log_(std::move(log)) {}

DataOutlet PlantData::outlet() {
  return {.publish = [this](const fabric::DataSample& sample) { publish(sample); },
          .let_go =
              [this](const fabric::DataSample& sample) {
                if (sample.group != programs::programs_group) {
                  end_->let_go(sample);
                }
              }};
}

void PlantData::publish(const fabric::DataSample& sample) {
  if (sample.group == programs::programs_group) {
    watch(sample);
  } else if (const auto published = end_->publish(sample); !published) {
    log_->warn("{}: data {} cannot be told: {}", sample.key.to_string(), sample.group,
               published.error());
  }
}

void PlantData::publish_also(const fabric::DataSample& sample) {
  if (!end_) {
    end_.emplace(participant_);
  }
  sample.values.empty() ? end_->let_go(sample) : publish(sample);
}

void PlantData::watch(const fabric::DataSample& sample) {
  auto& watches = machines_[sample.key.machine].watches;
  const auto found = watches.find(sample.key.channel);
  if (found == watches.end()) {
    return;
  }
  for (const fabric::ProgramEvent& event : found->second.on_sample(sample)) {
    log_->info("{}: program {}{}{}", event.key.to_string(),
               printable(event.program) + (event.program.empty() ? "" : " "),
               fabric::name_of(event.kind),
               event.error == 0 ? std::string() : fmt::format(" by error {}", event.error));
    if (const auto published = end_->publish(event); !published) {
      log_->warn("{}: an event of its program cannot be told: {}", event.key.to_string(),
                 published.error());
    }
  }
}

void PlantData::begin(const std::string& name, Machine& machine) {
  machine.data.reset();
  machine.watches.clear();
  data::DataSettings all = machine.settings;
  for (const programs::ProgramSettings& settings : machine.programs) {
    const fabric::ChannelKey key{name, settings.channel};
    machine.watches.emplace(settings.channel, programs::ProgramWatch(key, settings));
    all.groups.push_back(programs::group_of(settings));
  }
  if (all.groups.empty()) {
    return;
  }
  if (!end_) {
    end_.emplace(participant_);
  }
  machine.data = std::make_unique<MachineData>(executor_, name, all, now_, outlet(), log_);
  machine.data->connect(machine.client, machine.location);
  if (!machine.channels.empty()) {
    machine.data->on_up({machine.channels.begin(), machine.channels.end()});
  }
}

void PlantData::set(const std::vector<settings::MachineSettings>& machines) {
  for (const settings::MachineSettings& settings : machines) {
    const auto [found, is_new] = machines_.try_emplace(settings.name);
    Machine& machine = found->second;
    if (is_new || machine.settings != settings.data || machine.programs != settings.programs) {
      if (machine.data) {
        machine.data->on_over(0);
      }
      machine.settings = settings.data;
      machine.programs = settings.programs;
      begin(settings.name, machine);
    }
  }
}

void PlantData::connect(const std::string& machine, std::weak_ptr<cnc::ads::Client> client,
                        std::weak_ptr<const cnc::variables::Location> location) {
  Machine& one = machines_[machine];
  one.client = client;
  one.location = location;
  one.channels.clear();
  if (one.data) {
    one.data->connect(std::move(client), std::move(location));
  }
}

void PlantData::on_up(const std::string& machine, const std::vector<std::uint16_t>& channels) {
  Machine& one = machines_[machine];
  one.channels.insert(channels.begin(), channels.end());
  if (one.data) {
    one.data->on_up(channels);
  }
}

void PlantData::on_down(const std::string& machine) {
  Machine& one = machines_[machine];
  one.channels.clear();
  if (one.data) {
    one.data->on_down();
  }
}

void PlantData::on_dropped(const std::string& machine) {
  Machine& one = machines_[machine];
  one.channels.clear();
  if (one.data) {
    one.data->on_over(0);
  }
}

void PlantData::on_over(const fabric::ChannelKey& key) {
  Machine& one = machines_[key.machine];
  one.channels.erase(key.channel);
  if (one.data) {
    one.data->on_over(key.channel);
  }
}

}  // namespace millrace::gateway::live
