#include "tests/simulation/machine/channel.hpp"

#include <array>
#include <cstring>

#include "cnc/variables/text.hpp"

namespace millrace::tests::simulation {

namespace sim = cnc::simulator;
using gateway::Variable;

struct MachineChannel::Kernel {
  Kernel(sim::ServiceRules rules, const Agenda& agenda)
      : service(
            family, rules, [&agenda] { return agenda.now(); }, [](const auto&) {}) {
    for (const Variable variable : cnc::variables::all_service_variables) {
      variables.at(static_cast<std::size_t>(variable)) = family.find(name_of(variable));
    }
  }
  sim::Family family;
  sim::ServiceInterface service;
  std::array<sim::Variable*, cnc::variables::all_service_variables.size()> variables{};
};

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
  return written;
}

void MachineChannel::set(Variable variable, const gateway::Value& value) {
  const auto* state = std::get_if<std::uint32_t>(&value);
  const cnc::nc::Value program_value = state != nullptr
                                           ? cnc::nc::Value{static_cast<double>(*state)}
                                           : cnc::nc::Value{std::get<std::string>(value)};
  static_cast<void>(at(variable).assign(sim::Variable::scalar, program_value));
  const bool lit = this->state(Variable::request_state) != 0;
  if (variable == Variable::request_state || lit) {
    report();
  }
}

void MachineChannel::report() {
  const gateway::PendingRequest now{text(Variable::uuid), text(Variable::request),
                                    state(Variable::request_state)};
  standing_ = now;
  crossed = false;
  if (now.state != 0) {
    history_.add(ProgramAsked{key_, now});
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

void MachineChannel::reset() {
  kernel_->service.reset();
  if (rules_.reset_clears_states) {
    standing_ = {};
    history_.add(ProgramMoved{key_, "NC reset, both states are 0"});
  } else {
    history_.note(key_.to_string(), "NC reset");
  }
}

void MachineChannel::power_up() {
  if (kernel_) {
    history_.add(ProgramMoved{key_, "the controller starts again", false});
  }
  kernel_ = std::make_shared<Kernel>(rules_, agenda_);
  standing_ = {};
}

}  // namespace millrace::tests::simulation
