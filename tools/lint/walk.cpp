#include "tools/lint/walk.hpp"

#include <algorithm>
#include <deque>

#include <fmt/format.h>

namespace millrace::tools::lint {

namespace {

using cnc::nc::syntax::Operation;
using cnc::nc::syntax::Program;
using cnc::nc::syntax::Routine;
using Kind = Effect::Kind;

/// As deep as the controller goes (docs/nc-language.md).
constexpr int most_levels = 20;
constexpr std::size_t stages = 5;
constexpr std::string_view wait_cycle_name = "SysServiceWait.cyc";

std::size_t index_of(State state) {
  return static_cast<std::size_t>(state.stage) + (state.moves ? stages : 0);
}

State state_of(std::size_t index) {
  return {static_cast<Stage>(index % stages), index >= stages};
}

States only(State state) {
  return States().set(index_of(state));
}

/// It ends by M17 and never by M30: others call it.
bool is_subprogram(const Routine& routine) {
  bool returns = false;
  for (const Operation& operation : routine.operations) {
    for (const Effect& effect : effects_of(operation.statement)) {
      if (effect.kind == Kind::end && std::holds_alternative<syntax::Words>(operation.statement)) {
        return false;
      }
      returns |= effect.kind == Kind::end_of_subprogram;
    }
  }
  return returns;
}

bool reads_state(const std::vector<Effect>& effects) {
  return std::ranges::any_of(
      effects, [](const Effect& effect) { return effect.kind == Kind::response_state_read; });
}

const std::string* written_name(const syntax::Name& name) {
  return std::get_if<std::string>(&name);
}

const syntax::Expression* argument(const syntax::CycleCall& cycle, double number) {
  for (const syntax::CycleArgument& each : cycle.arguments) {
    if (constant_number(each.number) == number) {
      return &each.value;
    }
  }
  return nullptr;
}

}  // namespace

void Walk::follow(const Program& program) {
  const State before{is_subprogram(program.main) ? Stage::unknown : Stage::idle};
  run({&program, &program.main}, only(before), 0);
}

States Walk::run(const Where& where, States before, int depth) {
  States behind;
  for (std::size_t index = 0; index < before.size(); ++index) {
    if (before.test(index)) {
      behind |= run_from(where, state_of(index), depth);
    }
  }
  return behind;
}

States Walk::run_from(const Where& where, State before, int depth) {
  const auto [known, is_new] = known_.try_emplace({where, index_of(before)});
  if (!is_new) {
    return known->second;
  }
  const Routine& routine = *where.routine;
  const ControlFlow& flow = flow_of(routine);
  std::vector<States> seen(routine.operations.size() + 1);
  std::deque<std::size_t> todo;
  const auto come_to = [&](std::size_t at, States with) {
    const std::size_t place = std::min(at, routine.operations.size());
    if ((seen[place] | with) != seen[place]) {
      seen[place] |= with;
      todo.push_back(place);
    }
  };
  States behind;
  come_to(0, only(before));
  while (!todo.empty()) {
    const std::size_t at = todo.front();
    todo.pop_front();
    if (at == routine.operations.size()) {
      behind |= seen[at];
      continue;
    }
    const Operation& operation = routine.operations[at];
    const std::vector<Effect> effects = effects_of(operation.statement);
    const auto* const branch = std::get_if<syntax::Branch>(&operation.statement);
    const Loop* const loop =
        branch != nullptr && reads_state(effects) ? flow.innermost(at) : nullptr;
    const bool leaves_loop =
        loop != nullptr &&
        std::ranges::any_of(flow.behind(at), [&](std::size_t next) { return !loop->has(next); });
    for (std::size_t index = 0; index < States().size(); ++index) {
      if (!seen[at].test(index)) {
        continue;
      }
      State state = state_of(index);
      if (leaves_loop && state.stage == Stage::out) {
        // A loop that asks until there is an answer: a wait, and behind it there is one.
        const State answered = wait(
            where, operation,
            {.kind = Kind::wait, .judged = asks_for_one_state(branch->condition), .limited = true},
            state);
        for (const std::size_t next : flow.behind(at)) {
          come_to(next, only(loop->has(next) ? state : answered));
        }
        continue;
      }
      bool ends = false;
      bool returns = false;
      for (const Effect& effect : effects) {
        ends |= effect.kind == Kind::end;
        returns |= effect.kind == Kind::end_of_subprogram;
        state = apply(where, operation, at, effect, state);
      }
      if (ends) {
        continue;
      }
      if (returns) {
        behind |= only(state);
        continue;
      }
      const States after = call(where, operation, state, depth);
      for (const std::size_t next : flow.behind(at)) {
        come_to(next, after);
      }
    }
  }
  return known_[{where, index_of(before)}] = behind;
}

States Walk::call(const Where& where, const Operation& operation, State state, int depth) {
  if (const auto* const timer = std::get_if<syntax::TimerCommand>(&operation.statement)) {
    note_timer(where, operation, timer->id);
  } else if (const auto* const sub = std::get_if<syntax::SubprogramCall>(&operation.statement)) {
    const std::string* const name = written_name(sub->name);
    return name == nullptr ? only({Stage::unknown, state.moves})
                           : call_by_name(where, operation, *name, sub->local, state, depth);
  } else if (const auto* const cycle = std::get_if<syntax::CycleCall>(&operation.statement)) {
    const std::string* const name = written_name(cycle->name);
    if (name == nullptr) {
      return only({Stage::unknown, state.moves});
    }
    return *name == wait_cycle_name
               ? only(wait_cycle(where, operation, *cycle, state))
               : call_by_name(where, operation, *name, cycle->local, state, depth);
  }
  return only(state);
}

States Walk::call_by_name(const Where& where, const Operation& operation, const std::string& name,
                          bool local, State state, int depth) {
  if (depth >= most_levels) {
    return only({Stage::unknown, state.moves});
  }
  if (local) {
    const auto found = where.program->subprograms.find(name);
    return found == where.program->subprograms.end()
               ? only(state)
               : run({where.program, &found->second}, only(state), depth + 1);
  }
  if (const Program* const program = library_(name)) {
    return run({program, &program->main}, only(state), depth + 1);
  }
  note(where, operation, Rule::missing_subprogram,
       fmt::format("{} is not here; what it does to a call is not known (--path names folders)",
                   name));
  return only({Stage::unknown, state.moves});
}

State Walk::wait_cycle(const Where& where, const Operation& operation,
                       const syntax::CycleCall& cycle, State state) {
  const bool limited = argument(cycle, 2) != nullptr;
  if (const auto* const timer = argument(cycle, 3)) {
    note_timer(where, operation, *timer);
  } else if (limited) {
    note(where, operation, Rule::timer_missing,
         "@P2 limits the wait, and @P3 must say which timer (0 to 127) it may use for that");
  }
  // The cycle has the flush in it.
  state.moves = false;
  return wait(where, operation, {.kind = Kind::wait, .limited = limited}, state);
}

State Walk::apply(const Where& where, const Operation& operation, std::size_t at,
                  const Effect& effect, State state) {
  const bool waits = state.stage == Stage::out;
  switch (effect.kind) {
    case Kind::uuid:
    case Kind::request:
      if (waits) {
        note(where, operation, Rule::request_after_state,
             fmt::format("{} is written while REQUEST_STATE says that a request is there; the "
                         "service may get either text",
                         effect.kind == Kind::uuid ? "UUID" : "REQUEST"));
      }
      break;
    case Kind::request_state:
      if (effect.number == 0.0) {
        state.stage = Stage::idle;
        break;
      }
      if (state.stage == Stage::answered) {
        note(where, operation, Rule::answer_not_checked,
             "the next request is made before anything has looked at the RESPONSE_STATE of the "
             "last answer; it may have been an error");
      }
      look_at_repeats(where, at, effect);
      state.stage = Stage::out;
      break;
    case Kind::response_state_read:
      state.stage = state.stage == Stage::answered ? Stage::checked : state.stage;
      break;
    case Kind::response_read:
      if (state.stage == Stage::answered) {
        note(where, operation, Rule::answer_not_checked,
             "RESPONSE is used before anything has looked at RESPONSE_STATE; it may be the text "
             "of an error");
        state.stage = Stage::checked;
      }
      break;
    case Kind::wait:
      return wait(where, operation, effect, state);
    case Kind::motion:
      state.moves = true;
      break;
    case Kind::flush:
      state.moves = false;
      break;
    case Kind::end:
      if (state.stage == Stage::answered &&
          std::holds_alternative<syntax::Words>(operation.statement)) {
        note(where, operation, Rule::answer_not_checked,
             "the program ends and nothing has looked at the RESPONSE_STATE of the last answer");
      }
      break;
    case Kind::end_of_subprogram:
      break;
  }
  return state;
}

State Walk::wait(const Where& where, const Operation& operation, const Effect& effect,
                 State state) {
  if (state.stage == Stage::unknown) {
    return state;
  }
  if (state.stage == Stage::idle) {
    note(where, operation, Rule::wait_before_request,
         "on one path nothing has written REQUEST_STATE before this wait, so there will be no "
         "answer");
  }
  if (state.moves) {
    note(
        where, operation, Rule::wait_without_flush,
        "an axis moves before this wait, and its last block may be withheld until the program goes "
        "on, which it does not; #FLUSH CONTINUE before the wait lets it go");
  }
  if (!effect.limited) {
    note(where, operation, Rule::wait_without_timeout,
         "if no answer comes this waits for ever; SysServiceWait.cyc with @P2 and @P3 does not");
  }
  state.stage = effect.judged ? Stage::checked : Stage::answered;
  return state;
}

void Walk::look_at_repeats(const Where& where, std::size_t at, const Effect& effect) {
  if (!effect.number) {
    return;
  }
  const Loop* const loop = flow_of(*where.routine).innermost(at);
  if (loop == nullptr) {
    return;
  }
  for (std::size_t i = loop->first; i <= loop->last; ++i) {
    for (const Effect& other : effects_of(where.routine->operations[i].statement)) {
      const bool writes = other.kind == Kind::request || other.kind == Kind::uuid;
      if (writes && !other.text) {
        return;  // Another text each time.
      }
    }
  }
  note(where, where.routine->operations[at], Rule::same_state_in_loop,
       fmt::format("each turn of the loop asks the same with REQUEST_STATE {:g}; if the program "
                   "gives one up and asks again between two looks, nobody sees that it is another "
                   "one; a number that counts tells them apart",
                   *effect.number));
}

void Walk::note(const Where& where, const Operation& operation, Rule rule, std::string text) {
  note_({{where.program->file, operation.line, operation.column}, rule, std::move(text)});
}

void Walk::note_timer(const Where& where, const Operation& operation,
                      const syntax::Expression& id) {
  const auto number = constant_number(id);
  if (!number) {
    return;
  }
  const int timer = static_cast<int>(*number);
  if (std::ranges::find(timers_, timer, &TimerUse::timer) == timers_.end()) {
    timers_.push_back({timer, {where.program->file, operation.line, operation.column}});
  }
}

const ControlFlow& Walk::flow_of(const Routine& routine) {
  return flows_.try_emplace(&routine, routine).first->second;
}

}  // namespace millrace::tools::lint
