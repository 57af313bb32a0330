#include "tests/simulation/machine/channel.hpp"

#include <array>
#include <cstring>

#include <fmt/format.h>

#include "cnc/variables/value.hpp"
#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

namespace sim = cnc::simulator;
using gateway::Variable;

struct MachineChannel::Kernel {
  Kernel(const Key& key, sim::ServiceRules rules, const Agenda& agenda, Programs& programs)
      : channel(key.channel, settings_of(rules), {{}, std::make_shared<cnc::nc::Timers>()},
                {.clock = [&agenda] { return agenda.now(); }, .programs = programs}) {
    for (const Variable variable : cnc::variables::all_service_variables) {
      variables.at(static_cast<std::size_t>(variable)) =
          channel.store().family(sim::Kind::global).find(name_of(variable));
    }
  }
  static sim::Settings settings_of(sim::ServiceRules rules) {
    sim::Settings settings;
    settings.service = rules;
    settings.axes = {{"X"}};
    return settings;
  }
  sim::VirtualChannel channel;
  std::array<sim::Variable*, cnc::variables::all_service_variables.size()> variables{};
};

tl::expected<sim::Program, std::string> MachineChannel::Programs::load(std::string_view name) {
  const auto found = texts_.find(name);
  if (found == texts_.end()) {
    return tl::unexpected(std::string(name) + " is not there");
  }
  return sim::Program{found->first, found->second};
}

MachineChannel::MachineChannel(Key key, sim::ServiceRules rules, Agenda& agenda, History& history)
    : key_(std::move(key)), rules_(rules), agenda_(agenda), history_(history) {
  power_up();
}

sim::Variable& MachineChannel::at(Variable variable) const {
  return *kernel_->variables.at(static_cast<std::size_t>(variable));
}

gateway::Value MachineChannel::read(Variable variable) const {
  const cnc::ads::Bytes bytes = at(variable).bytes(sim::Variable::scalar);
  if (!cnc::variables::is_state(variable)) {
    return cnc::variables::decode_text(bytes);
  }
  std::uint32_t state = 0;
  std::memcpy(&state, bytes.data(), sizeof state);
  return state;
}

bool MachineChannel::write(Variable variable, const gateway::Value& value) {
  cnc::ads::Bytes bytes;
  if (const auto* state = std::get_if<std::uint32_t>(&value)) {
    bytes.resize(sizeof *state);
    std::memcpy(bytes.data(), state, sizeof *state);
  } else if (auto text = cnc::variables::encode_text(std::get<std::string>(value))) {
    bytes = std::move(*text);
  } else {
    return false;
  }
  const bool written = at(variable).write(sim::Variable::scalar, bytes).has_value();
  on_ads_write();
  changed();
  return written;
}

void MachineChannel::advance() {
  kernel_->channel.apply_writes(agenda_.now());
  on_ads_write();
  changed();
}

void MachineChannel::changed() {
  for (const auto& [watcher, tell] : watchers) {
    tell();
  }
}

void MachineChannel::set(Variable variable, const gateway::Value& value) {
  const auto* state = std::get_if<std::uint32_t>(&value);
  const cnc::nc::Value program_value = state != nullptr
                                           ? cnc::nc::Value{static_cast<double>(*state)}
                                           : cnc::nc::Value{std::get<std::string>(value)};
  static_cast<void>(at(variable).assign(sim::Variable::scalar, program_value));
  changed();
}

void MachineChannel::report(bool request_state) {
  const gateway::PendingRequest now{text(Variable::uuid), text(Variable::request),
                                    state(Variable::request_state)};
  if (standing_.state != 0 && (crossed || !released_)) {
    move_on();
  }
  if (now.state != 0) {
    gave_up_before_ = std::exchange(gave_up_, false);
  }
  released_ = false;
  lost_by_.reset();
  orphaned_ = false;
  asked_ = agenda_.now();
  wrote_before_ = std::exchange(writers, {});
  standing_ = now;
  // Only a write of REQUEST_STATE undoes the effect of a RESPONSE_STATE for the previous request,
  // immediate or a little later by the kernel.
  crossed = !request_state && (crossed || state(Variable::response_state) != 0);
  if (now.state != 0) {
    history_.add(ProgramAsked{key_, now, crossed});
  } else {
    history_.add(ProgramMoved{key_, "program takes its request back"});
  }
}

std::uint32_t MachineChannel::state(Variable variable) const {
  return std::get<std::uint32_t>(read(variable));
}

std::string MachineChannel::text(Variable variable) const {
  return std::get<std::string>(read(variable));
}

std::string MachineChannel::place() const {
  return fmt::format("{} {} {} {} {} {} {} {} {}", text(Variable::uuid), text(Variable::request),
                     state(Variable::request_state), state(Variable::response_state),
                     text(Variable::response), standing_.uuid, standing_.text, standing_.state,
                     crossed);
}

void MachineChannel::move_on() {
  moved_on_ = agenda_.now();
  gave_up_ = true;
}

void MachineChannel::cleared(const std::string& why) {
  standing_ = {};
  move_on();
  history_.add(ProgramMoved{key_, why + ", both states are 0"});
}

tl::expected<void, std::string> MachineChannel::start(const std::string& text) {
  const auto started = kernel_->channel.start({key_.to_string(), text});
  if (!started) {
    std::string mistakes;
    for (const auto& mistake : started.error()) {
      mistakes += mistake.to_string() + "; ";
    }
    return tl::unexpected(mistakes);
  }
  if (rules_.start_clears_states) {
    cleared("the program starts");
  }
  return {};
}

std::vector<cnc::nc::Event> MachineChannel::tick() {
  auto events = kernel_->channel.tick(agenda_.now(), 1);
  changed();
  return events;
}

bool MachineChannel::active() const {
  return kernel_->channel.program().active();
}

void MachineChannel::reset() {
  kernel_->channel.reset();
  if (rules_.reset_clears_states) {
    cleared("NC reset");
  } else {
    history_.note(key_.to_string(), "NC reset");
  }
  changed();
}

void MachineChannel::power_up() {
  if (kernel_) {
    history_.add(ProgramMoved{key_, "the controller starts again", false});
  }
  kernel_ = std::make_shared<Kernel>(key_, rules_, agenda_, programs_);
  standing_ = {};
  at(Variable::response_state).on_write([this](sim::Writer) {
    const std::uint32_t now = state(Variable::response_state);
    released_ = released_ || (now != 0 && !is_interim(now));
  });
  at(Variable::response).on_write([this](sim::Writer writer) {
    if (writer == sim::Writer::program) {
      history_.add(ResponseEmptied{key_});
    }
  });
  for (const Variable variable : {Variable::uuid, Variable::request, Variable::request_state}) {
    at(variable).on_write([this, variable](sim::Writer writer) {
      if (writer != sim::Writer::program) {
        return;
      }
      if (variable == Variable::request_state || state(Variable::request_state) != 0) {
        report(variable == Variable::request_state);
      } else if (standing_.state != 0 && (text(Variable::uuid) != standing_.uuid ||
                                          text(Variable::request) != standing_.text)) {
        // A gateway or the kernel has cleared REQUEST_STATE. The program now writes its next texts,
        // which is invisible until one of them differs.
        if (crossed || !std::exchange(released_, false)) {
          move_on();
        }
        standing_ = {};
        crossed = false;
        history_.add(ProgramMoved{key_, "program begins its next request", false});
      }
    });
  }
}

}  // namespace millrace::tests::simulation
