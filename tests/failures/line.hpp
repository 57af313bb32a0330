// The whole chain of real programs, with a proxy between gateway and controller. A test stops it at
// a chosen point of a call and breaks something there.
//
//   Line sut({.point = Point::running});
//   sut.reach();                                  // the second of three calls is there
//   sut.kill(Victim::gateway);
//   sut.expect_every_answer();
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tests/failures/ads_proxy.hpp"
#include "tests/integration/chain.hpp"

namespace millrace::tests::failures {

/// How far the second call of the program has come.
enum class Point {
  /// The gateway has seen REQUEST_STATE and asks for the texts.
  before_accept,
  /// Accepted, while the only instance is busy with another channel.
  accepted,
  /// Dispatched to an instance that has not begun the call (it is frozen).
  dispatched,
  /// The handler has begun.
  running,
  /// An interim state is about to be written.
  interim,
  /// The gateway has the reply; RESPONSE is about to be written.
  answered,
  /// RESPONSE is written, REQUEST_STATE about to be cleared.
  before_clear,
  /// REQUEST_STATE is cleared; RESPONSE_STATE, which releases the program, is about to be written.
  before_release,
};

enum class Victim { gateway, service, controller };

struct LineOptions {
  Point point = Point::running;
  bool at_most_once = false;
  /// The default one; without it, none.
  bool journal = true;
  /// On a fabric with trust.
  bool trust = false;
  /// A second gateway stands by, and has taken over before a killed one is started again.
  bool standby = false;
  /// The gateway reaches its controller over Secure ADS, whose frames the proxy does not see: only
  /// points without a frame are possible.
  bool secure = false;
};

class Line {
 public:
  explicit Line(LineOptions options);
  ~Line();

  /// Starts all programs and waits for the point.
  void reach();
  /// Whether a frame to the controller is held at this point.
  [[nodiscard]] bool at_a_frame() const;

  /// Ends the process as a crash does and starts another one. A held frame is lost or arrives.
  void kill(Victim victim, bool held_frame_arrives = false);
  /// Stops the process until the others have noticed, then continues it.
  void freeze(Victim victim);

  /// Each program gets its own three answers. After a kill of the controller, these are the
  /// programs that it has run since.
  void expect_every_answer();
  /// No handler began a call twice.
  void expect_no_call_ran_twice();
  /// Waits until the gateway has blocked the call, and answers it as an operator.
  void answer_the_held_call();
  /// Writes a variable of channel 1, as an operator does without the gateway.
  void write_variable(const std::string& name, const std::string& value);
  /// Whether the controller's programs have finished.
  [[nodiscard]] bool finished();

  AdsProxy& proxy() { return proxy_; }
  Process& gateway() { return *gateway_; }
  integration::Chain& chain() { return chain_; }

 private:
  void start_service();
  void start_gateway();
  void start_controller();
  void await_executions(std::size_t count);
  /// Waits until the gateway has logged these words this many times.
  void await_logged(const std::string& words, std::size_t times);
  /// Throws what the gateway has logged if it takes too long.
  void await(const std::string& what, const std::function<bool()>& done);

  LineOptions options_;
  integration::Chain chain_;
  AdsProxy proxy_;
  std::optional<Process> service_;
  std::optional<Process> gateway_;
  std::optional<Process> standby_;
  std::optional<Process> controller_;
};

}  // namespace millrace::tests::failures
