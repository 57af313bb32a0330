// What instances say, and what comes of it at once.
//
// - An answer that can be written is the answer, as it is. One that cannot be (too long, with a
//   NUL, of state 0, or without a text if its program waits for that) gives the program an error at
//   once: state 500, or what the policy says under which the call was accepted, which may be to
//   hold it.
// - What an instance says of a call that it was not given, or that is answered or over, changes
//   nothing, nor does an interim answer.
// - What a handler returns after it was told that nobody waits is never sent.
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
  void on(const GivenOut& fact);
  void on(const Replied& fact);
  void on(const ReplyTaken& fact);
  template <typename Other>
  void on(const Other&) {}
  void expect(bool right, const char* what, const fabric::Reply& reply);
  [[nodiscard]] static bool unchanged(const ReplyTaken& fact);
  void judge_refused(const ReplyTaken& fact);

  /// An answer: of which attempt, and when it was given.
  using Said = std::tuple<fabric::CallId, fabric::InstanceId, std::uint32_t, fabric::Time>;
  /// What gateways have refused since they started. It may be delivered again.
  std::map<GatewayNumber, std::set<Said>> refused_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
