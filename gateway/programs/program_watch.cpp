#include "gateway/programs/program_watch.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::programs {

using fabric::DataSample;
using fabric::ProgramEvent;
using fabric::ProgramEventKind;
using fabric::Value;

namespace {

const Value* good(const DataSample& sample, const std::string& name) {
  const auto found = std::ranges::find(sample.values, name, &Value::name);
  const bool is = found != sample.values.end() && found->quality == fabric::Quality::good &&
                  fabric::count(found->elements) > 0;
  return is ? &*found : nullptr;
}

/// A number of any type; a real one is cut.
std::optional<std::int64_t> number(const Value* value) {
  if (value == nullptr) {
    return std::nullopt;
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&value->elements)) {
    return integers->front();
  }
  if (const auto* reals = std::get_if<std::vector<double>>(&value->elements)) {
    constexpr double most = 9e18;
    return reals->front() >= -most && reals->front() <= most
               ? std::optional(static_cast<std::int64_t>(reals->front()))
               : std::nullopt;
  }
  return std::nullopt;
}

std::string text(const Value* value) {
  const auto* texts =
      value == nullptr ? nullptr : std::get_if<std::vector<std::string>>(&value->elements);
  return texts == nullptr ? std::string() : texts->front();
}

}  // namespace

data::GroupSettings group_of(const ProgramSettings& settings) {
  data::GroupSettings group{.name = programs_group,
                            .channel = settings.channel,
                            .names = {"state", "mode"},
                            .period = settings.period};
  for (const std::string& name : {settings.name, settings.error, settings.counter}) {
    if (!name.empty() && std::ranges::find(group.names, name) == group.names.end()) {
      group.names.push_back(name);
    }
  }
  return group;
}

std::optional<ProgramWatch::Look> ProgramWatch::look_of(const DataSample& sample) const {
  const Value* const value = good(sample, "state");
  const auto state = number(value);
  if (!state || *state < 0 || *state > static_cast<std::int64_t>(State::error)) {
    return std::nullopt;
  }
  Look look;
  look.state = State{static_cast<std::uint32_t>(*state)};
  look.mode = static_cast<std::uint32_t>(number(good(sample, "mode")).value_or(0));
  look.name = text(good(sample, settings_.name));
  look.error = static_cast<std::uint32_t>(number(good(sample, settings_.error)).value_or(0));
  look.parts = number(good(sample, settings_.counter));
  look.at = sample.at;
  return look;
}

std::vector<ProgramEvent> ProgramWatch::on_sample(const DataSample& sample) {
  std::vector<ProgramEvent> events;
  const auto now = look_of(sample);
  if (!now) {
    blind_ = true;
    return events;
  }
  if (last_) {
    step(*last_, *now, events);
  } else {
    begin(*now, events);
  }
  if (last_ && blind_) {
    for (ProgramEvent& event : events) {
      event.detail = base::messages::seen_after_reconnect();
    }
  }
  if (runs(now->state) && program_.empty()) {
    program_ = now->name;
  }
  blind_ = false;
  last_ = *now;
  return events;
}

void ProgramWatch::begin(const Look& now, std::vector<ProgramEvent>& events) {
  program_ = runs(now.state) || now.state == State::error ? now.name : std::string();
  if (runs(now.state)) {
    events.push_back(event(ProgramEventKind::started, now));
  }
  if (now.state == State::hold) {
    events.push_back(event(ProgramEventKind::on_hold, now));
  } else if (now.state == State::error) {
    events.push_back(event(ProgramEventKind::aborted, now));
  }
  for (ProgramEvent& found : events) {
    found.detail = base::messages::running_before();
  }
}

void ProgramWatch::step(const Look& before, const Look& now, std::vector<ProgramEvent>& events) {
  if (!runs(before.state) && runs(now.state)) {
    started_ = now.at;
    program_ = now.name;
    events.push_back(event(ProgramEventKind::started, now));
    if (now.state == State::hold) {
      events.push_back(event(ProgramEventKind::on_hold, now));
    }
  } else if (before.state == State::active && now.state == State::hold) {
    events.push_back(event(ProgramEventKind::on_hold, now));
  } else if (before.state == State::hold && now.state == State::active) {
    events.push_back(event(ProgramEventKind::resumed, now));
  } else if (runs(before.state) && !runs(now.state)) {
    events.push_back(event(end_of(before, now), now));
    if (now.state != State::error) {
      forget_run();
    }
  } else if (before.state != State::error && now.state == State::error) {
    // It began and failed between two reads.
    program_ = now.name;
    events.push_back(event(ProgramEventKind::aborted, now));
  } else if (before.state == State::error && now.state != State::error) {
    // The error was cleared: the aborted run needs no more attention.
    events.push_back(event(ProgramEventKind::reset, now));
    forget_run();
  }
}

void ProgramWatch::forget_run() {
  started_ = {};
  program_.clear();
}

ProgramEventKind ProgramWatch::end_of(const Look& before, const Look& now) const {
  if (now.state == State::error) {
    return ProgramEventKind::aborted;
  }
  const bool another_mode = before.mode != 0 && now.mode != 0 && before.mode != now.mode;
  const bool by_itself =
      before.state == State::active && (now.state == State::ready || now.state == State::selected);
  return by_itself && !another_mode ? ProgramEventKind::ended : ProgramEventKind::reset;
}

ProgramEvent ProgramWatch::event(ProgramEventKind kind, const Look& now) const {
  return {.key = key_,
          .kind = kind,
          .at = now.at,
          .started = started_,
          .program = program_,
          .error = kind == ProgramEventKind::aborted ? now.error : 0,
          .parts = now.parts,
          .mode = now.mode};
}

}  // namespace millrace::gateway::programs
