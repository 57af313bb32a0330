#include "cnc/simulator/machine.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace millrace::cnc::simulator {

Machine::Machine(Settings settings, const Surroundings& surroundings)
    : settings_(std::move(settings)), clock_(surroundings.clock), born_(clock_()) {
  for (const Declaration& declaration : settings_.externals) {
    if (declaration.external->global) {
      common_.externals.push_back(std::make_shared<Variable>(declaration));
    }
  }
  for (std::uint32_t number = 1; number <= settings_.channels; ++number) {
    channels_.push_back(std::make_unique<VirtualChannel>(number, settings_, common_, surroundings));
  }
}

VirtualChannel* Machine::channel(std::uint32_t number) {
  return number >= 1 && number <= channels_.size() ? channels_[number - 1].get() : nullptr;
}

std::uint32_t Machine::axes() const {
  return std::accumulate(channels_.begin(), channels_.end(), 0U,
                         [](std::uint32_t sum, const auto& channel) {
                           return sum + static_cast<std::uint32_t>(channel->axes().size());
                         });
}

std::vector<Happening> Machine::tick(std::chrono::nanoseconds now) {
  std::vector<Happening> happenings;
  for (const auto& channel : channels_) {
    for (nc::Event& event : channel->tick(now)) {
      happenings.push_back({channel->number(), std::move(event)});
    }
  }
  return happenings;
}

bool Machine::active() const {
  return std::any_of(channels_.begin(), channels_.end(),
                     [](const auto& channel) { return channel->program().active(); });
}

}  // namespace millrace::cnc::simulator
