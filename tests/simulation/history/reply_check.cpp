#include "tests/simulation/history/reply_check.hpp"

#include <utility>

#include <fmt/format.h>

#include "gateway/response.hpp"
#include "gateway/text.hpp"
#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

std::vector<std::string> ReplyCheck::on(const Fact& fact, Time) {
  std::visit([this](const auto& one) { on(one); }, fact);
  return std::exchange(violations_, {});
}

void ReplyCheck::expect(bool right, const char* what, const fabric::Reply& reply) {
  if (!right) {
    violations_.push_back(fmt::format("{}: \"{}\" state {} of {}: {}", reply.call.to_string(),
                                      gateway::printable(reply.text), reply.state,
                                      reply.instance.to_string().substr(0, 8), what));
  }
}

void ReplyCheck::on(const Resumed& fact) {
  if (fact.call == fabric::CallId{}) {
    refused_.erase(fact.gateway);
  }
}

void ReplyCheck::on(const Dispatched& fact) {
  // The journal may have lost an attempt of this number, whose answer was refused.
  std::erase_if(refused_[fact.gateway], [&](const Said& one) {
    const auto& [call, instance, attempt, when] = one;
    return call == fact.call && instance == fact.instance && attempt == fact.attempt;
  });
}

void ReplyCheck::on(const Replied& fact) {
  expect(!fact.reply.text.starts_with(unwanted),
         "its handler returned it after a cancellation, and it is sent", fact.reply);
}

/// The call may time out in the same moment: then the gateway has answered it.
bool ReplyCheck::unchanged(const ReplyReceived& fact) {
  return fact.now == fact.before || fact.now->instance == fabric::InstanceId{};
}

void ReplyCheck::on(const ReplyReceived& fact) {
  const fabric::Reply& reply = fact.reply;
  const Said said{reply.call, reply.instance, reply.attempt, reply.answered};
  const bool known = refused_[fact.gateway].contains(said);
  if (!fact.completion_signal || known || reply.kind != fabric::ReplyKind::final) {
    expect(unchanged(fact) && !fact.refusal_told,
           "it is not an answer to the call, and has an effect on it", reply);
    return;
  }
  const bool writable =
      gateway::Response::of(reply.text, reply.state, fact.program_awaits).has_value();
  if (!writable || reply.code == fabric::ServiceCode::refused) {
    refused_[fact.gateway].insert(said);
    judge_refused(fact);
    return;
  }
  const bool in_its_place = fact.now && fact.now->instance == fabric::InstanceId{};
  expect(in_its_place ||
             fact.now == gateway::Answer{reply.instance, reply.attempt, reply.text, reply.state},
         "it is the answer, and is not accepted as such", reply);
}

void ReplyCheck::judge_refused(const ReplyReceived& fact) {
  const fabric::Reply& reply = fact.reply;
  expect(fact.refusal_told, "it cannot be written, and the gateway does not report this", reply);
  if (fact.refused && fact.refused->response_state == 0) {
    expect(unchanged(fact), "it cannot be written, and the call is not blocked", reply);
    return;
  }
  // If the service itself replaces an answer that it refuses, the program gets the replacement.
  const auto instead = gateway::Response::of(reply.text, reply.state, fact.program_awaits);
  const std::uint32_t otherwise = instead ? reply.state : gateway::refused_state;
  const std::uint32_t state = fact.refused ? fact.refused->response_state : otherwise;
  const bool right_text =
      fact.now &&
      (instead ? fact.now->text == (fact.refused ? gateway::printable(reply.text) : reply.text)
               : fact.now->text.starts_with("ERROR: the service's answer "));
  expect(right_text && fact.now->state == state,
         "it cannot be written, and its program does not get an error at once", reply);
}

}  // namespace millrace::tests::simulation
