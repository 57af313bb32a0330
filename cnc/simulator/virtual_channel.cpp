#include "cnc/simulator/virtual_channel.hpp"

#include <cassert>
#include <memory>
#include <utility>

#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace {

nc::ChannelOptions options_of(const Settings& settings, const std::vector<AxisSettings>& axes) {
  nc::ChannelOptions options = settings.program;
  options.cycle = settings.cycle;
  options.axes.clear();
  for (const AxisSettings& axis : axes) {
    options.axes.push_back(axis.name);
    nc::AxisLimits limits{axis.negative_limit, axis.positive_limit};
    limits.greatest_feed = axis.greatest_feed > 0 ? axis.greatest_feed : limits.greatest_feed;
    options.limits.push_back(limits);
  }
  return options;
}

Variable::Computed value_of(std::string_view quantity, const AxisSettings& axis, std::size_t slot,
                            const std::function<double(std::size_t)>& position) {
  if (quantity == "V.A.-SWE") {
    return [limit = axis.negative_limit](std::uint32_t) { return nc::Value{limit}; };
  }
  if (quantity == "V.A.+SWE") {
    return [limit = axis.positive_limit](std::uint32_t) { return nc::Value{limit}; };
  }
  return [position, slot](std::uint32_t) { return nc::Value{position(slot)}; };
}

/// Adds "V.A.ABS.X" and so on, all axes of one quantity in a row. `position` returns the position
/// in mm of the axis in a slot, from 0.
void add_axis_variables(Family& family, const std::vector<AxisSettings>& axes,
                        const std::function<double(std::size_t)>& position) {
  for (const std::string_view quantity : axis_quantities) {
    for (std::size_t slot = 0; slot < axes.size(); ++slot) {
      Declaration declaration{fmt::format("{}.{}", quantity, axes[slot].name),
                              ElementType::number(Type::real64), Access::read_only};
      declaration.axis = axes[slot].name.size() + 1;
      family.add(std::make_shared<Variable>(std::move(declaration),
                                            value_of(quantity, axes[slot], slot, position)));
    }
  }
}

/// A read-only variable keeps its configured value.
std::shared_ptr<Variable> system_variable(Declaration declaration, const nc::Value& value) {
  if (declaration.access == Access::read_only) {
    return std::make_shared<Variable>(std::move(declaration),
                                      [value](std::uint32_t) { return value; });
  }
  auto variable = std::make_shared<Variable>(std::move(declaration));
  for (std::uint32_t element = 0; element < variable->declaration().elements(); ++element) {
    [[maybe_unused]] const auto assigned = variable->assign(element, value);
    assert(assigned.has_value());
  }
  return variable;
}

/// Adds the configured variables, one for each axis if they are per axis; each channel has its own.
void add_system_variables(Store& store, const std::vector<SystemVariable>& variables,
                          const std::vector<AxisSettings>& axes) {
  for (const SystemVariable& variable : variables) {
    const bool of_axes = variable.declaration.name.starts_with(prefix_of(Kind::axis));
    Family& family = store.family(of_axes ? Kind::axis : Kind::global);
    if (!variable.per_axis) {
      family.add(system_variable(variable.declaration, variable.value));
      continue;
    }
    for (const AxisSettings& axis : axes) {
      Declaration declaration = variable.declaration;
      declaration.name += "." + axis.name;
      declaration.axis = axis.name.size() + 1;
      declaration.behind += declaration.dimensions.empty() ? 0 : declaration.axis;
      family.add(system_variable(std::move(declaration), variable.value));
    }
  }
}

}  // namespace

VirtualChannel::VirtualChannel(std::uint32_t number, const Settings& settings, const Common& common,
                               const Surroundings& surroundings)
    : number_(number),
      axes_(settings.axes_of(number)),
      surroundings_(surroundings),
      system_data_(common.system_data),
      service_(store_.family(Kind::global), settings.service, surroundings.clock,
               [this](const AnsweredCall& call) { surroundings_.on_answered(number_, call); }),
      program_(options_of(settings, axes_), common.timers),
      control_(program_, surroundings.programs, settings.ready_after_end) {
  add_variables(settings, common);
}

void VirtualChannel::add_variables(const Settings& settings, const Common& common) {
  Family& globals = store_.family(Kind::global);
  globals.add(std::make_shared<Variable>(
      Declaration{"V.G.BLOCK_NR", ElementType::number(Type::sgn32), Access::read_only},
      [this](std::uint32_t) { return nc::Value{static_cast<double>(program_.block_number())}; }));
  globals.add(std::make_shared<Variable>(
      Declaration{
          "V.G.TIMER", ElementType::number(Type::uns32), Access::read_only, {nc::Timers::count}},
      [timers = common.timers](std::uint32_t id) {
        return nc::Value{static_cast<double>(timers->latched(id))};
      }));
  add_axis_variables(store_.family(Kind::axis), axes_,
                     [this](std::size_t slot) { return program_.axes().at(slot).position; });
  add_system_variables(store_, settings.variables, axes_);
  auto shared = common.externals.begin();
  for (const Declaration& declaration : settings.externals) {
    store_.family(Kind::external)
        .add(declaration.external->global ? *shared++ : std::make_shared<Variable>(declaration));
  }
}

tl::expected<void, Refusal> VirtualChannel::start(const Program& program) {
  return control_.start(program).map([this] {
    error_ = 0;
    service_.start();
  });
}

void VirtualChannel::reset() {
  control_.reset();
  service_.reset();
  error_ = 0;
}

tl::expected<void, Refusal> VirtualChannel::command_mode(Mode mode) {
  if (mode == Mode::standby) {
    service_.reset();
    error_ = 0;
  }
  return report(control_.set_mode(mode));
}

tl::expected<void, Refusal> VirtualChannel::command_state(ProcessState state) {
  if (state == ProcessState::selected) {
    service_.reset();
    error_ = 0;
  }
  const bool starts = state == ProcessState::active && control_.state() == ProcessState::ready;
  return report(control_.command(state).map([&] {
    if (starts) {
      service_.start();
    }
  }));
}

void VirtualChannel::command_parameter(std::string parameter) {
  control_.set_parameter(std::move(parameter));
}

void VirtualChannel::set_block_search(const BlockSearch& search) {
  constexpr std::uint16_t by_block_number = 4;
  search_ = search;
  const bool on = search.commanded && search.type == by_block_number;
  program_.set_block_search(on ? std::optional<long>(search.block) : std::nullopt);
}

tl::expected<void, Refusal> VirtualChannel::command_stream(std::string packet) {
  return report(program_.stream(std::move(packet)).map_error([this](const nc::Fault& fault) {
    return Refusal{
        nc::Diagnostic{{program_.options().stream_program, 0, 0, 0}, fault.id, fault.text}};
  }));
}

tl::expected<void, Refusal> VirtualChannel::report(tl::expected<void, Refusal> outcome) {
  if (!outcome) {
    for (const nc::Diagnostic& reason : outcome.error()) {
      unreported_.emplace_back(nc::WarningEvent{reason});
    }
  }
  surroundings_.on_command();
  return outcome;
}

std::vector<nc::Event> VirtualChannel::tick(std::chrono::nanoseconds now, std::size_t operations) {
  apply_writes(now);
  std::vector<nc::Event> events = std::exchange(unreported_, {});
  if (program_.active()) {
    for (nc::Event& event : program_.tick(now, *this, operations)) {
      if (const auto* aborted = std::get_if<nc::AbortedEvent>(&event)) {
        error_ = static_cast<std::uint32_t>(aborted->why.id);
      }
      events.push_back(std::move(event));
    }
  }
  return events;
}

tl::expected<nc::Value, nc::Fault> VirtualChannel::read(std::string_view name) {
  if (is_system_data(name)) {
    return system_data_->value(name);
  }
  return element(name).map(
      [](const Selection& found) { return found.variable->value(*found.element); });
}

tl::expected<void, nc::Fault> VirtualChannel::write(std::string_view name, const nc::Value& value) {
  if (is_system_data(name)) {
    return system_data_->assign(name, value);
  }
  return element(name).and_then(
      [&](const Selection& found) { return found.variable->assign(*found.element, value); });
}

bool VirtualChannel::synchronous(std::string_view name) {
  const Variable* const variable = store_.family(Kind::external).find(name);
  return variable == nullptr || variable->declaration().external->synchronised;
}

std::size_t VirtualChannel::elements(std::string_view name) {
  return system_data_->elements(name);
}

tl::expected<void, nc::Fault> VirtualChannel::initialise(std::string_view name) {
  const auto found = store_.find(name);
  if (!found) {
    return tl::unexpected(nc::Fault{0, fmt::format("unknown variable {}", name)});
  }
  const Declaration& declaration = found->variable->declaration();
  const nc::Value nothing =
      declaration.element.type == Type::string ? nc::Value(std::string()) : nc::Value(0.0);
  const std::uint32_t first = found->element.value_or(0);
  const std::uint32_t end = found->element ? first + 1 : declaration.elements();
  for (std::uint32_t element = first; element < end; ++element) {
    if (auto assigned = found->variable->assign(element, nothing); !assigned) {
      return assigned;
    }
  }
  return {};
}

tl::expected<std::string, nc::Fault> VirtualChannel::load(std::string_view program) {
  return surroundings_.programs.load(program)
      .map([](Program&& found) { return std::move(found.text); })
      .map_error([](const std::string& reason) {
        return nc::Fault{0, reason};
      });
}

tl::expected<Selection, nc::Fault> VirtualChannel::element(std::string_view name) const {
  const auto found = store_.find(name);
  if (!found) {
    return tl::unexpected(nc::Fault{0, fmt::format("unknown variable {}", name)});
  }
  if (!found->element) {
    return tl::unexpected(nc::Fault{0, fmt::format("{} is an array: an index is missing", name)});
  }
  return *found;
}

}  // namespace millrace::cnc::simulator
