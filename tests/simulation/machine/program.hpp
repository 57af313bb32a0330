// An NC program that calls services one after the other. It may lose patience, be reset at any
// point, and repeat itself.
#pragma once

#include <string>
#include <vector>

#include "tests/simulation/machine/channel.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct ProgramBehaviour {
  /// The services it calls, in any order.
  std::vector<std::string> uuids;
  std::size_t calls = 5;
  /// Percentage of calls.
  unsigned impatient = 10;
  unsigned repeats_itself = 0;
  /// It rewrites one of the three variables of its request while it waits.
  unsigned changes = 0;
  /// The longest wait of an impatient one.
  Time patience = 1500ms;
  /// It empties RESPONSE, then waits until it has a text; it does not look at a state.
  bool waits_for_text = false;
  /// All services that it calls know that: then its haste does no harm, except after an answer that
  /// no service gave.
  bool services_know = false;
  /// The time between two writes, and between two looks at RESPONSE_STATE.
  Time cycle = 2ms;
  Time pause = 50ms;
  /// It is a program in the NC language, run by the interpreter of the virtual CNC.
  bool interpreted = false;
  /// Its SysServiceWait.cyc waits for REQUEST_STATE to become 0: a mistake (bug.hpp).
  bool waits_for_the_request = false;
};

/// The program of a channel, scripted or interpreted.
class Program {
 public:
  virtual ~Program() = default;

  /// Runs its remaining calls.
  virtual void start() = 0;
  /// It ends where it is.
  virtual void stop() = 0;
  /// From now on it waits without limit and begins at most one more call.
  virtual void calm_down() = 0;
  [[nodiscard]] virtual bool active() const = 0;
  [[nodiscard]] virtual bool done() const = 0;
  [[nodiscard]] virtual std::size_t answered() const = 0;
  /// It may wait in vain: it began its request before the previous answer was complete, whose last
  /// writes wiped it; or the text it waits for was overwritten by a gateway that did not hear the
  /// answering one.
  [[nodiscard]] virtual bool may_be_stuck() const { return false; }
  /// Its position: two programs at the same one continue in the same way. For a walk through all
  /// orders; empty if it is unknown.
  [[nodiscard]] virtual std::string place() const { return {}; }
};

}  // namespace millrace::tests::simulation
