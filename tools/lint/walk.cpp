#include "tools/lint/walk.hpp"

#include <algorithm>
#include <deque>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "cnc/nc/characters.hpp"
#include "tools/lint/types.hpp"

namespace millrace::tools::lint {

namespace {

using cnc::nc::syntax::Operation;
using cnc::nc::syntax::Program;
using cnc::nc::syntax::Routine;
using Kind = Effect::Kind;

/// As deep as the controller goes (docs/reference/nc-language.md).
constexpr int most_levels = 20;

States only(State state) {
  return States().set(index_of(state));
}

/// It ends with M17 and never with M30: others call it.
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

}  // namespace

const syntax::Expression* argument(const syntax::CycleCall& cycle, double number) {
  for (const syntax::CycleArgument& each : cycle.arguments) {
    if (constant_number(each.number) == number) {
      return &each.value;
    }
  }
  return nullptr;
}

bool is_wait_cycle(const syntax::CycleCall& cycle) {
  const std::string* const name = written_name(cycle.name);
  return name != nullptr && cnc::nc::same_word(*name, "SysServiceWait.cyc");
}

void Walk::follow(const Program& program) {
  const bool is_part = is_subprogram(program.main);
  const States behind =
      run({&program, &program.main},
          only({.stage = is_part ? Stage::unknown : Stage::idle, .named = is_part}), 0);
  if (!is_part) {
    check_last({&program, &program.main}, behind);
  }
  for (const TimerUse& limit : limits_) {
    const auto own = std::ranges::find(started_, limit.timer, &TimerUse::timer);
    if (own != started_.end()) {
      note_({limit.place, Rule::shared_timer,
             fmt::format("SysServiceWait.cyc clears and stops timer {}, which the program starts "
                         "for itself in line {}; pass another one as @P3",
                         limit.timer, own->place.line)});
    }
  }
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
    if (is_skipped(operation)) {
      come_to(at + 1, seen[at]);
      continue;
    }
    const auto* const branch = std::get_if<syntax::Branch>(&operation.statement);
    const bool asks = branch != nullptr && reads_state(effects);
    std::optional<std::size_t> certain_way;  // $WHILE TRUE
    if (branch != nullptr && !asks) {
      if (const auto truth = truth_at(branch->condition, branch->rule, 0)) {
        certain_way = *truth == branch->when ? branch->target : at + 1;
      }
    }
    for (std::size_t index = 0; index < States().size(); ++index) {
      if (!seen[at].test(index)) {
        continue;
      }
      State state = state_of(index);
      if (asks && state.stage != Stage::unknown && state.stage != Stage::idle) {
        for (const Way& way : paths_after(where, at, state)) {
          come_to(way.to, only(way.state));
        }
        continue;
      }
      if (branch != nullptr && (state.stage == Stage::matched || state.stage == Stage::unmatched)) {
        state.stage = Stage::checked;  // What was found out may have been kept in a variable.
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
      for (const std::size_t next : certain_way ? std::vector{*certain_way} : flow.behind(at)) {
        come_to(next, after);
      }
    }
  }
  for (std::size_t at = 0; at < routine.operations.size(); ++at) {
    if (seen[at].any() && !is_skipped(routine.operations[at])) {
      check_all_paths(where, at, seen[at]);
    }
  }
  return known_[{where, index_of(before)}] = behind;
}

std::vector<Walk::Way> Walk::paths_after(const Where& where, std::size_t at, State state) {
  const auto& branch = std::get<syntax::Branch>(where.routine->operations[at].statement);
  const std::size_t next = at + 1;
  const auto with = [&](Stage stage) { return State{stage, state.moves, state.named}; };
  if (state.stage != Stage::out && state.stage != Stage::polled) {
    return {{next, with(Stage::matched)}, {branch.target, with(Stage::unmatched)}};
  }
  if (const Loop* const loop = polling_loop(where, at)) {
    return paths_after_poll(where, at, *loop, state);
  }
  // A single check: only one of its branches is taken before the response.
  const auto truth = truth_at(branch.condition, branch.rule, 0);
  if (!truth) {
    return {{next, with(Stage::checked)}, {branch.target, with(Stage::checked)}};
  }
  const bool jumps = *truth == branch.when;
  return {{next, with(jumps ? Stage::checked : Stage::polled)},
          {branch.target, with(jumps ? Stage::polled : Stage::checked)}};
}

std::vector<Walk::Way> Walk::paths_after_poll(const Where& where, std::size_t at, const Loop& loop,
                                              State state) {
  const Operation& operation = where.routine->operations[at];
  const auto& branch = std::get<syntax::Branch>(operation.statement);
  const ControlFlow& flow = flow_of(*where.routine);
  const std::size_t next = at + 1;
  const auto with = [&](Stage stage) { return State{stage, state.moves, state.named}; };
  const auto answered = [&](bool limited) {
    return wait(
        where, operation,
        {.kind = Kind::wait, .judged = asks_for_one_state(branch.condition), .limited = limited},
        state);
  };
  const auto truth = truth_at(branch.condition, branch.rule, 0);
  if (!truth) {
    // The same condition may limit its time.
    const bool next_leaves = flow.leaves(loop, next);
    if (next_leaves == flow.leaves(loop, branch.target)) {
      return {{next, with(Stage::checked)}, {branch.target, with(Stage::checked)}};
    }
    return {{next, next_leaves ? answered(true) : with(Stage::polled)},
            {branch.target, next_leaves ? with(Stage::polled) : answered(true)}};
  }
  const std::size_t without = *truth == branch.when ? branch.target : next;
  const std::size_t other = without == next ? branch.target : next;
  if (flow.leaves(loop, without) && !flow.leaves(loop, other)) {
    note(where, operation, Rule::wait_for_nothing,
         "the loop ends while RESPONSE_STATE is 0, which it is until the response is there; it "
         "should run for as long");
    return {{next, with(Stage::checked)}, {branch.target, with(Stage::checked)}};
  }
  return {{without, with(Stage::polled)}, {other, answered(is_limited(where, loop))}};
}

const Loop* Walk::polling_loop(const Where& where, std::size_t at) {
  const Loop* const loop = flow_of(*where.routine).innermost(at);
  if (loop == nullptr) {
    return nullptr;
  }
  for (std::size_t i = loop->first; i <= loop->last; ++i) {
    for (const Effect& effect : effects_of(where.routine->operations[i].statement)) {
      if (effect.kind == Kind::request_state && effect.number != 0.0) {
        return nullptr;
      }
    }
  }
  return loop;
}

bool Walk::is_limited(const Where& where, const Loop& loop) {
  const ControlFlow& flow = flow_of(*where.routine);
  // The conditions that leave the loop after the response, or never.
  std::set<std::size_t> by_answer;
  for (std::size_t at = loop.first; at <= loop.last; ++at) {
    const syntax::Statement& statement = where.routine->operations[at].statement;
    const auto* const branch = std::get_if<syntax::Branch>(&statement);
    const std::vector<Effect> effects = effects_of(statement);
    if (branch != nullptr && truth_at(branch->condition, branch->rule, 0)) {
      by_answer.insert(at);
      for (const std::size_t next : flow.behind(at)) {
        if (flow.jumps(next)) {
          by_answer.insert(next);
        }
      }
    }
    const bool leaves =
        std::ranges::any_of(flow.behind(at), [&](std::size_t next) { return !loop.has(next); });
    const bool ends = std::ranges::any_of(effects, [](const Effect& effect) {
      return effect.kind == Kind::end || effect.kind == Kind::end_of_subprogram;
    });
    if (ends || (leaves && !by_answer.contains(at))) {
      return true;
    }
  }
  return false;
}

States Walk::call(const Where& where, const Operation& operation, State state, int depth) {
  if (operation.unclear) {
    return only({Stage::unknown, state.moves, true});
  }
  if (const auto* const timer = std::get_if<syntax::TimerCommand>(&operation.statement)) {
    note_timer(where, operation, timer->id, timers_);
    if (timer->action == syntax::TimerAction::start) {
      note_timer(where, operation, timer->id, started_);
    }
  } else if (const auto* const sub = std::get_if<syntax::SubprogramCall>(&operation.statement)) {
    const std::string* const name = written_name(sub->name);
    return name == nullptr ? only({Stage::unknown, state.moves, true})
                           : call_by_name(where, operation, *name, sub->local, state, depth);
  } else if (const auto* const cycle = std::get_if<syntax::CycleCall>(&operation.statement)) {
    const std::string* const name = written_name(cycle->name);
    if (name == nullptr) {
      return only({Stage::unknown, state.moves, true});
    }
    return is_wait_cycle(*cycle)
               ? only(wait_cycle(where, operation, *cycle, state))
               : call_by_name(where, operation, *name, cycle->local, state, depth);
  }
  return only(state);
}

States Walk::call_by_name(const Where& where, const Operation& operation, const std::string& name,
                          bool local, State state, int depth) {
  if (depth >= most_levels || name.empty()) {
    return only({Stage::unknown, state.moves, true});
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
       fmt::format("{} was not found, so its effect on a call is unknown (--path names folders)",
                   name));
  return only({Stage::unknown, state.moves, true});
}

const ControlFlow& Walk::flow_of(const Routine& routine) {
  return flows_.try_emplace(&routine, routine).first->second;
}

}  // namespace millrace::tools::lint
