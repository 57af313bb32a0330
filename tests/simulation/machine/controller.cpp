#include "tests/simulation/machine/controller.hpp"

#include <algorithm>

#include <fmt/ranges.h>

#include "tests/simulation/machine/interpreted_program.hpp"
#include "tests/simulation/machine/scripted_program.hpp"

namespace millrace::tests::simulation {

void Controller::add(cnc::simulator::ServiceRules rules, ProgramBehaviour behaviour,
                     Random random) {
  const Key key{name_, static_cast<std::uint16_t>(lines_.size() + 1)};
  Line line;
  line.channel = std::make_unique<MachineChannel>(key, rules, agenda_, history_);
  if (behaviour.interpreted) {
    line.program = std::make_unique<InterpretedProgram>(*line.channel, std::move(behaviour),
                                                        agenda_, party_, history_, random);
  } else {
    line.program = std::make_unique<ScriptedProgram>(*line.channel, std::move(behaviour), agenda_,
                                                     party_, history_, random);
  }
  lines_.push_back(std::move(line));
}

void Controller::add_queue(RingPlan plan, Random random) {
  const Key key = plan.settings.key(name_);
  rings_.push_back(
      std::make_unique<MessageRing>(key, std::move(plan), agenda_, party_, history_, random));
}

MessageRing& Controller::queue(const std::string& name) const {
  return **std::ranges::find(rings_, name, [](const auto& ring) -> const std::string& {
    return ring->plan().settings.name;
  });
}

std::vector<std::uint16_t> Controller::numbers() const {
  std::vector<std::uint16_t> numbers;
  for (std::size_t i = 1; i <= lines_.size(); ++i) {
    numbers.push_back(static_cast<std::uint16_t>(i));
  }
  return numbers;
}

void Controller::start_programs() {
  for (Line& line : lines_) {
    if (kernel_clears()) {
      history_.add(KernelClears{line.channel->key()});
    }
    line.program->start();
  }
  for (const auto& ring : rings_) {
    ring->start();
  }
}

void Controller::reset(std::uint16_t number, Time pause) {
  Line& line = lines_.at(number - 1U);
  if (!powered_) {
    return;
  }
  line.program->stop();
  line.channel->reset();
  for (const auto& ring : rings_) {
    if (ring->key().channel == number) {
      ring->stop();
      agenda_.after(pause, {.parties = parties()}, [this, &ring = *ring, life = life_] {
        if (life == life_) {
          ring.start();
        }
      });
    }
  }
  const auto again = agenda_.meaning(line.channel->key().to_string(), "starts again");
  agenda_.after(pause, {.parties = parties(), .means = again}, [this, &line, life = life_] {
    if (life == life_ && !line.program->active()) {
      line.program->start();
    }
  });
}

void Controller::switch_off() {
  history_.note(name_, "is switched off");
  powered_ = false;
  ++life_;
  for (Line& line : lines_) {
    line.program->stop();
  }
  for (const auto& ring : rings_) {
    ring->stop();
  }
}

void Controller::switch_on() {
  if (powered_) {
    return;
  }
  powered_ = true;
  for (Line& line : lines_) {
    line.channel->power_up();
    line.program->start();
  }
  for (const auto& ring : rings_) {
    ring->power_up();
    ring->start();
  }
}

bool Controller::done() const {
  return std::ranges::all_of(lines_, [](const Line& line) { return line.program->done(); }) &&
         std::ranges::all_of(rings_, [](const auto& ring) { return ring->done(); });
}

std::string Controller::place() const {
  std::string words = fmt::format("{} {} {}", powered_, life_, fmt::join(leftovers, ","));
  for (const Line& line : lines_) {
    words += fmt::format("|{}|{}", line.program->place(), line.channel->place());
  }
  return words;
}

void Controller::calm_down() {
  for (Line& line : lines_) {
    line.program->calm_down();
  }
  for (const auto& ring : rings_) {
    ring->calm_down();
  }
}

}  // namespace millrace::tests::simulation
