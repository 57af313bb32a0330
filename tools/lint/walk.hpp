// Follows every path of an NC program through its service calls: jumps, loops, subprograms, cycles.
// Pure.
//
// Its knowledge at a place is the set of states in which the program may come there: how far a call
// is, whether an axis moves since the last #FLUSH, and whether UUID was written. A rule is broken
// if one of them breaks it; rules about all states are checked when a routine is done.
//
//   Walk walk(library, note);
//   walk.follow(program);
#pragma once

#include <bitset>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cnc/nc/syntax/program.hpp"
#include "tools/lint/control_flow.hpp"
#include "tools/lint/effects.hpp"
#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {

/// How far the call of a channel is.
enum class Stage : std::uint8_t {
  /// Of a subprogram that is checked alone, or after a missing one: no rule is broken.
  unknown,
  /// Nothing was asked.
  idle,
  /// REQUEST_STATE is written.
  out,
  /// The same, and a loop has checked for the response: it was not there.
  polled,
  /// The program has waited; the state is not checked yet.
  answered,
  /// The state is checked.
  checked,
  /// The state was compared, and this is one of the two branches …
  matched,
  /// … and this the other.
  unmatched,
};

struct State {
  Stage stage = Stage::idle;
  /// An axis may still move, so the last block may be withheld.
  bool moves = false;
  /// UUID was written.
  bool named = false;
};

/// A set of them.
using States = std::bitset<32>;

/// A timer that a program uses.
struct TimerUse {
  int timer = 0;
  Place place;
};

class Walk {
 public:
  /// The program that is called by this name, or null; it outlives the walk.
  using Library = std::function<const cnc::nc::syntax::Program*(const std::string& name)>;
  using Note = std::function<void(Finding finding)>;

  /// Blocks of `skipped_level` (/, /2 …) are not executed; 0: all are.
  Walk(Library library, Note note, int skipped_level = 0)
      : library_(std::move(library)), note_(std::move(note)), skipped_level_(skipped_level) {}

  /// A main program, or a subprogram alone.
  void follow(const cnc::nc::syntax::Program& program);

  /// In the order of the text, each timer once.
  [[nodiscard]] const std::vector<TimerUse>& timers() const { return timers_; }

 private:
  /// A routine, and its program.
  struct Where {
    const cnc::nc::syntax::Program* program = nullptr;
    const cnc::nc::syntax::Routine* routine = nullptr;
    auto operator<=>(const Where&) const = default;
  };
  /// Where a program continues, and how.
  struct Way {
    std::size_t to = 0;
    State state;
  };

  States run(const Where& where, States before, int depth);
  States run_from(const Where& where, State before, int depth);
  States call(const Where& where, const cnc::nc::syntax::Operation& operation, State state,
              int depth);
  States call_by_name(const Where& where, const cnc::nc::syntax::Operation& operation,
                      const std::string& name, bool local, State state, int depth);
  State wait_cycle(const Where& where, const cnc::nc::syntax::Operation& operation,
                   const cnc::nc::syntax::CycleCall& cycle, State state);
  /// After a condition that checks RESPONSE_STATE.
  std::vector<Way> paths_after(const Where& where, std::size_t at, State state);
  std::vector<Way> paths_after_poll(const Where& where, std::size_t at, const Loop& loop,
                                    State state);
  /// The loop around an operation, if it may be a wait: it makes no request itself.
  const Loop* polling_loop(const Where& where, std::size_t at);
  /// Does it also end without a response?
  bool is_limited(const Where& where, const Loop& loop);
  [[nodiscard]] bool is_skipped(const cnc::nc::syntax::Operation& operation) const {
    return skipped_level_ > 0 && operation.skip_level == skipped_level_;
  }

  // The rules (walk_rules.cpp).
  /// The state after the effect.
  State apply(const Where& where, const cnc::nc::syntax::Operation& operation, std::size_t at,
              const Effect& effect, State state);
  State wait(const Where& where, const cnc::nc::syntax::Operation& operation, const Effect& effect,
             State state);
  void check_repeats(const Where& where, std::size_t at, const Effect& effect);
  void check_limit(const Where& where, const cnc::nc::syntax::Operation& operation,
                   const cnc::nc::syntax::CycleCall& cycle);
  /// Mistakes that exist only if every path comes to the place in a like state.
  void check_all_paths(const Where& where, std::size_t at, States states);
  void check_unawaited(const Where& where, std::size_t at, const std::vector<Effect>& effects,
                       States states);
  /// At the end of a main program that has no M30.
  void check_last(const Where& where, States states);
  void note(const Where& where, const cnc::nc::syntax::Operation& operation, Rule rule,
            std::string text);
  void note_timer(const Where& where, const cnc::nc::syntax::Operation& operation,
                  const cnc::nc::syntax::Expression& id, std::vector<TimerUse>& uses);
  const ControlFlow& flow_of(const cnc::nc::syntax::Routine& routine);

  Library library_;
  Note note_;
  int skipped_level_;
  std::vector<TimerUse> timers_;
  /// Timers that #TIMER START starts, and those that limit waits.
  std::vector<TimerUse> started_;
  std::vector<TimerUse> limits_;
  std::map<const cnc::nc::syntax::Routine*, ControlFlow> flows_;
  std::map<std::pair<Where, std::size_t>, States> known_;
};

constexpr std::size_t stage_count = 8;

inline std::size_t index_of(State state) {
  return static_cast<std::size_t>(state.stage) + (state.moves ? stage_count : 0) +
         (state.named ? 2 * stage_count : 0);
}

inline State state_of(std::size_t index) {
  return {static_cast<Stage>(index % stage_count), (index / stage_count) % 2 == 1,
          index >= 2 * stage_count};
}

/// The argument @P`number` of a cycle; null if there is none.
const cnc::nc::syntax::Expression* argument(const cnc::nc::syntax::CycleCall& cycle, double number);

/// SysServiceWait.cyc, in any case, as the controller takes file names.
bool is_wait_cycle(const cnc::nc::syntax::CycleCall& cycle);

}  // namespace millrace::tools::lint
