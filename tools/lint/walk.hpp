// Follows every path of an NC program through its service calls: jumps, loops, subprograms, cycles.
// Pure.
//
// What it knows at a place is the set of states in which the program may come there: how far a call
// is, and whether an axis moves since the last #FLUSH. A rule is broken where one of them breaks
// it.
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
  /// Of a subprogram that is looked at by itself, or behind one that is not there: nothing is
  /// wrong.
  unknown,
  /// Nothing was asked.
  idle,
  /// REQUEST_STATE is written.
  out,
  /// Waited for; nobody has looked at the state yet.
  answered,
  /// Somebody has.
  checked,
};

struct State {
  Stage stage = Stage::idle;
  /// An axis may still move, and with it the last block may be withheld.
  bool moves = false;
};

/// A set of them.
using States = std::bitset<10>;

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

  Walk(Library library, Note note) : library_(std::move(library)), note_(std::move(note)) {}

  /// A main program, or a subprogram by itself.
  void follow(const cnc::nc::syntax::Program& program);

  /// In the order of the text, each timer once.
  [[nodiscard]] const std::vector<TimerUse>& timers() const { return timers_; }

 private:
  /// A routine, and the program it stands in.
  struct Where {
    const cnc::nc::syntax::Program* program = nullptr;
    const cnc::nc::syntax::Routine* routine = nullptr;
    auto operator<=>(const Where&) const = default;
  };

  States run(const Where& where, States before, int depth);
  States run_from(const Where& where, State before, int depth);
  States call(const Where& where, const cnc::nc::syntax::Operation& operation, State state,
              int depth);
  States call_by_name(const Where& where, const cnc::nc::syntax::Operation& operation,
                      const std::string& name, bool local, State state, int depth);
  State wait_cycle(const Where& where, const cnc::nc::syntax::Operation& operation,
                   const cnc::nc::syntax::CycleCall& cycle, State state);
  /// The state behind the effect.
  State apply(const Where& where, const cnc::nc::syntax::Operation& operation, std::size_t at,
              const Effect& effect, State state);
  State wait(const Where& where, const cnc::nc::syntax::Operation& operation, const Effect& effect,
             State state);
  void look_at_repeats(const Where& where, std::size_t at, const Effect& effect);
  void note(const Where& where, const cnc::nc::syntax::Operation& operation, Rule rule,
            std::string text);
  void note_timer(const Where& where, const cnc::nc::syntax::Operation& operation,
                  const cnc::nc::syntax::Expression& id);
  const ControlFlow& flow_of(const cnc::nc::syntax::Routine& routine);

  Library library_;
  Note note_;
  std::vector<TimerUse> timers_;
  std::map<const cnc::nc::syntax::Routine*, ControlFlow> flows_;
  std::map<std::pair<Where, std::size_t>, States> known_;
};

}  // namespace millrace::tools::lint
