// Replies of instances, and their immediate effects.
//
// - A valid answer reaches the program unchanged. For an invalid one (too long, with a NUL, of
// state
//   0, or without a text if its program waits for that) the program gets an error at once: state
//   500, or what the policy of the accepted call demands, which may be to block it.
// - A reply has no effect on a call that was not dispatched to its instance, or that is answered or
//   over. Nor has an interim answer.
// - What a handler returns after a cancellation is never sent.
#pragma once

#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class ReplyCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;

 private:
  void on(const Resumed& fact);
  void on(const Dispatched& fact);
  void on(const Replied& fact);
  void on(const ReplyReceived& fact);
  template <typename Other>
  void on(const Other&) {}
  void expect(bool right, const char* what, const fabric::Reply& reply);
  [[nodiscard]] static bool unchanged(const ReplyReceived& fact);
  void judge_refused(const ReplyReceived& fact);

  /// An answer: its attempt, and its time.
  using Said = std::tuple<fabric::CallId, fabric::InstanceId, std::uint32_t, fabric::Time>;
  /// The answers that gateways have refused since they started. They may be delivered again.
  std::map<GatewayNumber, std::set<Said>> refused_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
