#include "cnc/simulator/machine.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace millrace::cnc::simulator {

namespace {

/// Of the decoders of all channels in a cycle, so that it is kept; running channels share them
/// evenly.
constexpr std::size_t operations_per_cycle = 3'200;
/// Of each channel, for any number of channels.
constexpr std::size_t least_operations = 10;

}  // namespace

Machine::Machine(Settings settings, const Surroundings& surroundings)
    : settings_(std::move(settings)),
      clock_(surroundings.clock),
      born_(clock_()),
      common_{
          {}, std::make_shared<nc::Timers>(), std::make_shared<SystemData>(settings_.system_data)} {
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

std::optional<Machine::Axis> Machine::axis(std::uint32_t number) {
  for (const auto& channel : channels_) {
    const auto count = static_cast<std::uint32_t>(channel->axes().size());
    if (number >= 1 && number <= count) {
      return Axis{channel.get(), number};
    }
    number -= number == 0 ? 0 : count;
  }
  return std::nullopt;
}

std::uint32_t Machine::first_axis(std::uint32_t channel) const {
  std::uint32_t first = 1;
  for (std::uint32_t before = 1; before < channel; ++before) {
    first += static_cast<std::uint32_t>(channels_[before - 1]->axes().size());
  }
  return first;
}

std::uint32_t Machine::axes() const {
  return std::accumulate(channels_.begin(), channels_.end(), 0U,
                         [](std::uint32_t sum, const auto& channel) {
                           return sum + static_cast<std::uint32_t>(channel->axes().size());
                         });
}

void Machine::apply_writes() {
  const ServiceRules& rules = settings_.service;
  if (rules.writes_visible_after.count() == 0 && !rules.kernel_clears_after) {
    return;
  }
  for (const auto& channel : channels_) {
    channel->apply_writes(clock_());
  }
}

std::vector<NcEvent> Machine::tick(std::chrono::nanoseconds now) {
  const auto running = std::count_if(channels_.begin(), channels_.end(), [](const auto& channel) {
    return channel->program().active();
  });
  const std::size_t share =
      operations_per_cycle / static_cast<std::size_t>(std::max<std::ptrdiff_t>(running, 1));
  std::vector<NcEvent> happenings;
  for (const auto& channel : channels_) {
    for (nc::Event& event : channel->tick(now, std::max(share, least_operations))) {
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
