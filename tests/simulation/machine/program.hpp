// An NC program that calls services one after the other. It may lose patience, be reset at any
// point, and repeat itself.
#pragma once

#include <string>
#include <vector>

#include "tests/simulation/machine/channel.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct ProgramHabits {
  /// What it calls, in any order.
  std::vector<std::string> uuids;
  std::size_t calls = 5;
  /// In a hundred calls.
  unsigned impatient = 10;
  unsigned repeats_itself = 0;
  /// It writes one of the three variables of its request anew while it waits.
  unsigned changes = 0;
  /// The longest that an impatient one waits.
  Time patience = 1500ms;
  /// It waits until RESPONSE, which it empties before, has a text, and looks at no state.
  bool waits_for_text = false;
  /// All services that it calls know that: then its haste does no harm, but after an answer that no
  /// service gave.
  bool services_know = false;
  /// Between two writes, and until RESPONSE_STATE is looked at again.
  Time cycle = 2ms;
  Time pause = 50ms;
  /// It is a program of the NC language, run by the interpreter of the virtual CNC.
  bool interpreted = false;
  /// Its SysServiceWait.cyc waits for REQUEST_STATE to become 0: a mistake (bug.hpp).
  bool waits_for_the_request = false;
};

/// What the program of a channel does, whoever runs it.
class Program {
 public:
  virtual ~Program() = default;

  /// Runs what is left of its calls.
  virtual void start() = 0;
  /// It ends where it is.
  virtual void stop() = 0;
  /// From now on it waits as long as it takes and begins at most one more call.
  virtual void calm_down() = 0;
  [[nodiscard]] virtual bool active() const = 0;
  [[nodiscard]] virtual bool done() const = 0;
  [[nodiscard]] virtual std::size_t answered() const = 0;
  /// It may wait for what does not come. It began its request before the answer to the one before
  /// was complete, whose last writes wiped it; or the text it waits for was overwritten by a
  /// gateway that did not hear of the one that answered.
  [[nodiscard]] virtual bool may_be_stuck() const { return false; }
  /// Where it is: two that are at the same go on in the same way. For who tries all orders; empty
  /// if it cannot be told.
  [[nodiscard]] virtual std::string place() const { return {}; }
};

}  // namespace millrace::tests::simulation
