// The rules of the walk: how an operation changes the state of a call, and which mistakes it can
// be.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/lint/walk.hpp"

namespace millrace::tools::lint {

namespace {

using cnc::nc::syntax::Operation;
using Kind = Effect::Kind;
using Flaw = Effect::Flaw;

constexpr double most_timer = 127;
/// Documented: 1193 hours (IB/tf5200_programming_manual/207464587).
constexpr double greatest_time = 4294967295.0;
/// A smaller value means seconds; a response takes some milliseconds.
constexpr double least_time = 100;

bool is_out(Stage stage) {
  return stage == Stage::out || stage == Stage::polled;
}

bool has_stage(States states, Stage stage) {
  for (std::size_t index = 0; index < states.size(); ++index) {
    if (states.test(index) && state_of(index).stage == stage) {
      return true;
    }
  }
  return false;
}

/// On every path with a request the program has not waited for the response.
bool is_unawaited(States states) {
  for (std::size_t index = 0; index < states.size(); ++index) {
    const Stage stage = state_of(index).stage;
    if (states.test(index) && stage != Stage::idle && stage != Stage::out) {
      return false;
    }
  }
  return has_stage(states, Stage::out);
}

bool is_named(States states) {
  for (std::size_t index = 0; index < states.size(); ++index) {
    if (states.test(index) && state_of(index).named) {
      return true;
    }
  }
  return false;
}

std::string_view text_of(Flaw flaw) {
  switch (flaw) {
    case Flaw::other_variable:
      return "this waits for something other than the response; wait until RESPONSE_STATE is not 0";
    case Flaw::over_at_once:
      return "this is true at once: RESPONSE_STATE is 0 from the request until the response; wait "
             "until it is not 0";
    case Flaw::never_over:
      return "no RESPONSE_STATE makes this true, so it waits for ever; wait until it is not 0";
    case Flaw::none:
      break;
  }
  return {};
}

}  // namespace

State Walk::wait_cycle(const Where& where, const Operation& operation,
                       const syntax::CycleCall& cycle, State state) {
  const bool limited = argument(cycle, 2) != nullptr;
  if (const auto* const timer = argument(cycle, 3)) {
    note_timer(where, operation, *timer, timers_);
    if (limited) {
      note_timer(where, operation, *timer, limits_);
    }
  } else if (limited) {
    note(where, operation, Rule::timer_missing,
         "@P2 limits the wait, and @P3 must name the timer (0 to 127) for it");
  }
  check_limit(where, operation, cycle);
  // The cycle has the flush in it.
  state.moves = false;
  return wait(where, operation, {.kind = Kind::wait, .limited = limited}, state);
}

State Walk::apply(const Where& where, const Operation& operation, std::size_t at,
                  const Effect& effect, State state) {
  const bool waits = is_out(state.stage);
  switch (effect.kind) {
    case Kind::uuid:
    case Kind::request:
      if (waits) {
        note(where, operation, Rule::request_after_state,
             fmt::format("{} is written while REQUEST_STATE shows a pending request; the service "
                         "may get either text",
                         effect.kind == Kind::uuid ? "UUID" : "REQUEST"));
      }
      state.named = state.named || effect.kind == Kind::uuid;
      break;
    case Kind::request_state:
      if (effect.number == 0.0) {
        state.stage = Stage::idle;
        break;
      }
      if (state.stage == Stage::answered) {
        note(where, operation, Rule::answer_not_checked,
             "the next request is made before the program has checked RESPONSE_STATE of the last "
             "response; it may have been an error");
      }
      check_repeats(where, at, effect);
      state.stage = Stage::out;
      state.named = true;  // One finding says it for the whole program.
      break;
    case Kind::response_state_read:
      // In a loop it is a wait of the program's own; elsewhere it was reported.
      if (state.stage == Stage::answered || (waits && !effect.shown)) {
        state.stage = Stage::checked;
      }
      break;
    case Kind::response_written:
      if (waits) {
        note(
            where, operation, Rule::answer_written,
            fmt::format("{0} is written while the request is pending, and may overwrite or replace "
                        "the response; write {0} before REQUEST_STATE, or leave it to the service",
                        effect.text.value_or("")));
      }
      break;
    case Kind::response_read:
      if (state.stage == Stage::answered) {
        note(where, operation, Rule::answer_not_checked,
             "RESPONSE is used before the program has checked RESPONSE_STATE; it may be the text "
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
             "the program ends without a check of RESPONSE_STATE of the last response");
      }
      break;
    case Kind::end_of_subprogram:
      break;
    case Kind::configured_call:
      note(where, operation, Rule::missing_subprogram,
           "the configuration of the channel names the subprogram of G80 to G89 and G800 to G839, "
           "so its effect on a call is unknown");
      return {Stage::unknown, state.moves, true};
  }
  return state;
}

State Walk::wait(const Where& where, const Operation& operation, const Effect& effect,
                 State state) {
  if (state.stage == Stage::unknown) {
    return state;
  }
  if (effect.flaw == Flaw::other_variable && !is_out(state.stage)) {
    return state;  // It may wait for whatever it likes.
  }
  if (effect.flaw == Flaw::never_over || (effect.flaw != Flaw::none && is_out(state.stage))) {
    note(where, operation, Rule::wait_for_nothing, std::string(text_of(effect.flaw)));
    state.stage = Stage::checked;
    return state;
  }
  if (state.stage == Stage::idle) {
    note(where, operation, Rule::wait_before_request,
         "on one path REQUEST_STATE is not written before this wait, so no response will come");
  }
  if (state.moves) {
    note(where, operation, Rule::wait_without_flush,
         "an axis moves before this wait, and the controller may withhold the last block until the "
         "program continues, which it does not; write #FLUSH CONTINUE before the wait");
  }
  if (!effect.limited) {
    note(where, operation, Rule::wait_without_timeout,
         "without a response this waits for ever; SysServiceWait.cyc with @P2 and @P3 has a time "
         "limit");
  }
  state.stage = effect.judged ? Stage::checked : Stage::answered;
  return state;
}

void Walk::check_repeats(const Where& where, std::size_t at, const Effect& effect) {
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
       fmt::format("each turn of the loop makes the same request with REQUEST_STATE {:g}; if the "
                   "program withdraws one and makes the next between two reads of the gateway, the "
                   "gateway cannot see that it is another one; use a number that counts",
                   *effect.number));
}

void Walk::check_limit(const Where& where, const Operation& operation,
                       const syntax::CycleCall& cycle) {
  const auto* const limit = argument(cycle, 2);
  const auto time = limit == nullptr ? std::nullopt : constant_number(*limit);
  if (!time) {
    return;
  }
  if (*time < least_time) {
    note(where, operation, Rule::time_limit,
         fmt::format("@P2 is in milliseconds, and {} is less than a response may take; if seconds "
                     "are meant, write {}",
                     *time, std::max(*time, 1.0) * 1000));
  } else if (*time > greatest_time) {
    note(where, operation, Rule::time_limit,
         fmt::format("@P2 is in milliseconds, and no timer reaches {}, so the wait has no limit; "
                     "the largest value is {}",
                     *time, greatest_time));
  }
}

void Walk::check_all_paths(const Where& where, std::size_t at, States states) {
  const Operation& operation = where.routine->operations[at];
  const std::vector<Effect> effects = effects_of(operation.statement);
  if (is_unawaited(states)) {
    check_unawaited(where, at, effects, states);
  }
  bool named = is_named(states);
  for (const Effect& effect : effects) {
    named = named || effect.kind == Kind::uuid;
    if (effect.kind == Kind::request_state && effect.number != 0.0 && !named) {
      note(where, operation, Rule::no_uuid,
           "V.G.SERVICE.UUID is not written before this request, so it goes to the service of the "
           "last program; write UUID first");
      named = true;
    }
  }
  const bool uses = std::holds_alternative<syntax::Words>(operation.statement) &&
                    std::ranges::any_of(effects, [](const Effect& effect) {
                      return effect.kind == Kind::response_read;
                    });
  if (uses && has_stage(states, Stage::matched) && has_stage(states, Stage::unmatched)) {
    note(where, operation, Rule::error_goes_on,
         "RESPONSE is used here in both branches of the check of RESPONSE_STATE, so also if it is "
         "the text of an error; end that branch ($GOTO, M30, #ERROR), or use RESPONSE only in the "
         "other one");
  }
}

void Walk::check_unawaited(const Where& where, std::size_t at, const std::vector<Effect>& effects,
                           States states) {
  const Operation& operation = where.routine->operations[at];
  if (const auto* const cycle = std::get_if<syntax::CycleCall>(&operation.statement)) {
    const auto* const at_state = argument(*cycle, 1);
    const auto state = at_state == nullptr ? std::nullopt : constant_number(*at_state);
    if (is_wait_cycle(*cycle) && state && *state != 0 && !has_stage(states, Stage::idle)) {
      note(where, operation, Rule::wait_for_nothing,
           fmt::format("this ends at once: it waits while RESPONSE_STATE is {}, and that is 0 "
                       "until the response; omit @P1, or write 0",
                       *state));
    }
    return;
  }
  for (const Effect& effect : effects) {
    switch (effect.kind) {
      case Kind::response_read:
      case Kind::response_state_read:
        if (polling_loop(where, at) == nullptr) {
          note(where, operation, Rule::answer_before_wait,
               fmt::format("{} is used without a wait for the response since the request; wait "
                           "first (#WAIT FOR, SysServiceWait.cyc): a dwell is not a wait",
                           effect.kind == Kind::response_read ? "RESPONSE" : "RESPONSE_STATE"));
        }
        return;
      case Kind::request_state:
        if (effect.number != 0.0) {
          note(where, operation, Rule::answer_not_awaited,
               "the next request is made without a wait for the response to the last one, which it "
               "replaces; wait first (#WAIT FOR, SysServiceWait.cyc)");
        }
        return;
      case Kind::end:
        if (std::holds_alternative<syntax::Words>(operation.statement)) {
          note(where, operation, Rule::answer_not_awaited,
               "the program ends without a wait for the response to its request; wait first (#WAIT "
               "FOR, SysServiceWait.cyc): a dwell is not a wait");
        }
        return;
      case Kind::wait:
        return;
      default:
        break;
    }
  }
}

void Walk::check_last(const Where& where, States states) {
  if (is_unawaited(states) && !where.routine->operations.empty()) {
    note(where, where.routine->operations.back(), Rule::answer_not_awaited,
         "the program ends after this without a wait for the response to its request; wait first "
         "(#WAIT FOR, SysServiceWait.cyc): a dwell is not a wait");
  }
}

void Walk::note(const Where& where, const Operation& operation, Rule rule, std::string text) {
  note_({{where.program->file, operation.line, operation.column}, rule, std::move(text)});
}

void Walk::note_timer(const Where& where, const Operation& operation, const syntax::Expression& id,
                      std::vector<TimerUse>& uses) {
  const auto number = constant_number(id);
  if (!number) {
    return;
  }
  if (*number < 0 || *number > most_timer || *number != std::floor(*number)) {
    note(where, operation, Rule::timer_range,
         fmt::format("timer {} does not exist; the timers are 0 to {}", *number, most_timer));
    return;
  }
  const int timer = static_cast<int>(*number);
  if (std::ranges::find(uses, timer, &TimerUse::timer) == uses.end()) {
    uses.push_back({timer, {where.program->file, operation.line, operation.column}});
  }
}

}  // namespace millrace::tools::lint
