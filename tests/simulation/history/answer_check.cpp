#include "tests/simulation/history/answer_check.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/response.hpp"
#include "gateway/text.hpp"
#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

std::vector<std::string> AnswerCheck::on(const Fact& fact, Time now) {
  violations_.clear();
  std::visit([&](const auto& kind) { on(kind, now); }, fact);
  return std::exchange(violations_, {});
}

void AnswerCheck::close(Channel& channel, Time now) {
  for (Stretch& stretch : channel.stretches) {
    stretch.until = stretch.until.value_or(now);
  }
}

void AnswerCheck::on(const ProgramAsked& fact, Time now) {
  Channel& channel = channels_[fact.key];
  close(channel, now);
  for (const Stretch& stretch : channel.stretches) {
    // A repetition of its previous request: it may get the same answer again.
    if (stretch.answered_by && stretch.request == fact.request) {
      finals_.erase(*stretch.answered_by);
    }
  }
  // A repetition: a 0 that was written before may be meant for it as well.
  channel.cleared = channel.cleared && channel.asked == fact.request;
  channel.asked = fact.request;
  channel.stretches.push_back({fact.request, now, {}, {}});
  channel.wiped = false;
  channel.texts_left = false;
  channel.crossed = fact.crossed;
  channel.writers_before = std::exchange(channel.writers, {});
}

void AnswerCheck::on(const ProgramMoved& fact, Time now) {
  Channel& channel = channels_[fact.key];
  channel.texts_left = fact.texts_stay;
  const auto& stretches = channel.stretches;
  // The last stretch may be of a request that was given up before and answered late.
  auto last = stretches.rbegin();
  if (last != stretches.rend() && !last->answered_by) {
    last = std::find_if(last, stretches.rend(),
                        [&](const Stretch& stretch) { return stretch.request == channel.asked; });
  }
  if (fact.texts_stay && last != stretches.rend() && last->answered_by) {
    // Both states are 0 and the texts are unchanged: as if the last write had never arrived.
    finals_.erase(*last->answered_by);
    channel.wiped = true;
  } else if (!fact.texts_stay) {
    channel.wiped = false;
  }
  if (!(channel.cleared && fact.texts_stay)) {
    close(channel, now);
  }
}

void AnswerCheck::on(const Claimed& fact, Time) {
  reads_[{fact.gateway, fact.key}] = {fact.call, fact.request.state};
}

void AnswerCheck::on(const Replied& fact, Time) {
  if (fact.reply.kind == fabric::ReplyKind::final) {
    replies_[fact.reply.call].push_back(fact.reply);
  }
}

void AnswerCheck::on(const SnapshotRead& fact, Time now) {
  if (fact.snapshot.has(gateway::Variable::request_state)) {
    if (const auto read = reads_.find({fact.gateway, fact.key}); read != reads_.end()) {
      const bool same = fact.snapshot.request_state == read->second.asked;
      read->second.anew = read->second.anew || (same && read->second.moved);
      read->second.moved = read->second.moved || !same;
    }
  }
  if (fact.snapshot.has(gateway::Variable::uuid) &&
      fact.snapshot.has(gateway::Variable::request_state)) {
    looks_[{fact.gateway, fact.key}] = {
        fact.first, now, {fact.snapshot.uuid, fact.snapshot.request, fact.snapshot.request_state}};
    const auto zeroed = zeroed_.find({fact.gateway, fact.key});
    if (zeroed != zeroed_.end() && (zeroed->second.uuid != fact.snapshot.uuid ||
                                    zeroed->second.text != fact.snapshot.request)) {
      zeroed_.erase(zeroed);
    }
  }
}

void AnswerCheck::judge_value(const WriteAsked& fact) {
  const auto expect = [&](bool right, const char* what) {
    if (!right) {
      violations_.push_back(fmt::format("{} for {} is {}", name_of(fact.variable).substr(12),
                                        fact.call.to_string(), what));
    }
  };
  if (const auto* text = std::get_if<std::string>(&fact.value)) {
    expect(text->size() <= fabric::max_text && text->find('\0') == std::string::npos,
           "not valid for a channel");
    expect(!text->starts_with(strange), "from a stranger's reply");
    expect(!text->starts_with(unwanted), "the result of a cancelled handler");
  } else if (fact.variable == gateway::Variable::response_state &&
             fact.completion_signal == fabric::CompletionSignal::response_state) {
    expect(fact.value != gateway::Value{std::uint32_t{0}}, "0, which releases no program");
  }
}

void AnswerCheck::on(const WriteAsked& fact, Time) {
  judge_value(fact);
  if (fact.variable == gateway::Variable::request_state) {
    clearing_.insert(fact.call);
    zeroed_.insert_or_assign({fact.gateway, fact.key}, fact.request);
  } else if (fact.variable == gateway::Variable::response &&
             fact.completion_signal == fabric::CompletionSignal::response &&
             !clearing_.contains(fact.call) && !channels_[fact.key].kernel_clears) {
    violations_.push_back(
        fmt::format("I3: {} releases its program by RESPONSE before REQUEST_STATE is cleared",
                    fact.call.to_string()));
  }
  if (const auto read = reads_.find({fact.gateway, fact.key});
      read != reads_.end() && read->second.call == fact.call) {
    if (read->second.anew) {
      violations_.push_back(fmt::format(
          "I2: {} of {} is written, although its gateway has read a later request of the program",
          name_of(fact.variable).substr(12), fact.call.to_string()));
    }
  }
  // It may be executed or not; the gateway may never know.
  channels_[fact.key].cleared |= fact.variable == gateway::Variable::request_state;
  const auto look = looks_.find({fact.gateway, fact.key});
  if (look == looks_.end()) {
    violations_.push_back(fmt::format("I2: {} is written to {} without a read",
                                      fact.call.to_string(), fact.key.to_string()));
    return;
  }
  const auto answered = answered_.find({fact.gateway, fact.call});
  // For a channel that the gateway writes itself, reading takes no time.
  const bool at_once = !fabric::queue_of(fact.key.machine).empty();
  if (fact.variable == gateway::Variable::request_state && answered != answered_.end() &&
      look->second.end + Time(at_once ? 1 : 0) <= answered->second) {
    violations_.push_back(fmt::format("I2: {} is answered without a read since its answer arrived",
                                      fact.call.to_string()));
    return;
  }
  Channel& channel = channels_[fact.key];
  const auto& stretches = channel.stretches;
  const bool stood = std::ranges::any_of(stretches, [&](const Stretch& stretch) {
    const bool of_request = stretch.request == fact.request && stretch.from <= look->second.end;
    return of_request && (!stretch.until || *stretch.until >= look->second.first ||
                          stretch.answered_by == fact.call);
  });
  const bool seems_to_wait =
      channel.wiped && !stretches.empty() && stretches.back().request == fact.request;
  // Where the kernel clears REQUEST_STATE, the answer of a gateway out of hearing looks like an
  // interim one; and a text that releases a program may be any gateway's.
  const auto has_other_writer = [&](const std::set<GatewayNumber>& writers) {
    return writers.size() > writers.count(fact.gateway);
  };
  const bool answered_unseen =
      (channel.kernel_clears && has_other_writer(channel.all_writers)) ||
      (fact.completion_signal == fabric::CompletionSignal::response &&
       (has_other_writer(channel.writers) || has_other_writer(channel.writers_before)));
  const auto zeroed = zeroed_.find({fact.gateway, fact.key});
  const bool seems_cleared = zeroed != zeroed_.end() && zeroed->second == fact.request &&
                             look->second.shown.state == 0 &&
                             fact.variable != gateway::Variable::request_state;
  if (!stood && !seems_to_wait && !seems_cleared && !answered_unseen && !channel.crossed) {
    violations_.push_back(fmt::format(
        "I2: {} of {} is written for \"{}\", which its program had given up before the last look",
        name_of(fact.variable).substr(12), fact.call.to_string(), fact.request.text));
  } else if (fact.variable == gateway::Variable::request_state && channel.texts_left) {
    blur(channel, fact.request);
  }
}

/// From now on no gateway can tell whether a gateway or the program has cleared REQUEST_STATE.
void AnswerCheck::blur(Channel& channel, const gateway::PendingRequest& request) {
  if (channel.stretches.empty()) {
    return;
  }
  Stretch& last = channel.stretches.back();
  if (last.request == request && !last.answered_by) {
    channel.cleared = true;
    last.until.reset();
  }
}

void AnswerCheck::on(const Answered& fact, Time now) {
  answered_[{fact.gateway, fact.call}] = now;
}

void AnswerCheck::on(const WriteDone& fact, Time now) {
  Channel& channel = channels_[fact.key];
  channel.writers.insert(fact.gateway);
  channel.all_writers.insert(fact.gateway);
  channel.crossed = channel.crossed || fact.crossed;
  if (fact.variable == gateway::Variable::response) {
    channel.text_by = fact.gateway;
  }
  const auto stands = [&](const Stretch& stretch) {
    return !stretch.until && stretch.request == fact.request;
  };
  const bool crossed = std::ranges::none_of(channel.stretches, stands);
  if (crossed && fact.variable != gateway::Variable::response) {
    // The write was under way when the program moved on. Afterwards the call seems to be still
    // there.
    channel.stretches.push_back({fact.request, now, {}, {}});
  }
  if (!fact.answer) {
    if (fact.variable == gateway::Variable::request_state) {
      // Such a late write may have wiped RESPONSE_STATE, whichever gateway wrote that, and the
      // program waits again.
      finals_.erase(fact.call);
      for (const Stretch& stretch : channel.stretches) {
        if (stretch.answered_by && stretch.request == fact.request) {
          finals_.erase(*stretch.answered_by);
        }
      }
    }
    return;
  }
  judge_writer(fact);
  if (!crossed && !fact.crossed && fact.response != fact.answer->text &&
      channel.text_by == fact.gateway) {
    violations_.push_back(fmt::format("I3: {} is released while RESPONSE is \"{}\", not \"{}\"",
                                      fact.call.to_string(), fact.response, fact.answer->text));
  }
  const auto has_other_writer = [&](const std::set<GatewayNumber>& writers) {
    return writers.size() > writers.count(fact.gateway);
  };
  // Of two gateways that do not see each other, one has cleared the program's next, equal request:
  // for the other one its RESPONSE, which releases the program, is lost.
  const bool unseen =
      fact.variable == gateway::Variable::response &&
      (has_other_writer(channel.writers) || has_other_writer(channel.writers_before));
  if (++finals_[fact.call] > 1 && !unseen) {
    violations_.push_back(
        fmt::format("I1: {} is answered {} times", fact.call.to_string(), finals_[fact.call]));
  }
  if (fact.request_state != 0) {
    // The program has repeated its request already. It may continue with this answer while its
    // request stays; no gateway can tell. A gateway with the call in its journal then answers it.
    if (!channel.stretches.empty() && channel.stretches.back().request == fact.request) {
      finals_.erase(fact.call);
    }
    return;
  }
  for (Stretch& stretch : channel.stretches) {
    if (stands(stretch)) {
      stretch.until = now;
      stretch.answered_by = fact.call;
    }
  }
}

/// The answer must be a reply of the instance to this call.
void AnswerCheck::judge_writer(const WriteDone& fact) {
  const gateway::Answer& answer = *fact.answer;
  const auto gives_answer = [&](const fabric::Reply& reply) {
    return reply.instance == answer.instance &&
           (answer.text == gateway::printable(reply.text) || answer.text == reply.text ||
            stands_for_a_refused_one(answer.text));
  };
  if (answer.instance != fabric::InstanceId{} &&
      std::ranges::none_of(replies_[fact.call], gives_answer)) {
    violations_.push_back(
        fmt::format("I10: {} is answered with \"{}\", which instance {} has not said of it",
                    fact.call.to_string(), answer.text, answer.instance.to_string().substr(0, 8)));
  }
}

void AnswerCheck::on(const Resumed& fact, Time) {
  if (fact.call == fabric::CallId{}) {
    std::erase_if(reads_, [&](const auto& read) { return read.first.first == fact.gateway; });
  } else {
    reads_[{fact.gateway, fact.key}] = {.call = fact.call, .asked = fact.request.state};
  }
  if (fact.clearing) {
    clearing_.insert(fact.call);
    blur(channels_[fact.key], fact.request);
  }
}

void AnswerCheck::on(const JournalLost&, Time) {
  // A program that repeats its request gets the answer of a call whose end is forgotten.
  finals_.clear();
}

void AnswerCheck::on(const KernelClears& fact, Time) {
  channels_[fact.key].kernel_clears = true;
}

void AnswerCheck::on(const ResponseEmptied& fact, Time) {
  channels_[fact.key].text_by.reset();
}

void AnswerCheck::on(const ProgramReleased& fact, Time) {
  if (!fact.crossed && !fact.by_text && fact.state == 0 && channels_[fact.key].writers.size() < 2) {
    violations_.push_back(
        fmt::format("I3: {} goes on although RESPONSE_STATE is 0", fact.key.to_string()));
    return;
  }
  if (!fact.crossed && !answers(fact.text, fact.request)) {
    violations_.push_back(fmt::format(
        "I2: {} asked \"{}\" of {} with state {} and reads \"{}\"", fact.key.to_string(),
        fact.request.text, fact.request.uuid.substr(0, 8), fact.request.state, fact.text));
  }
}

std::vector<std::string> ReplyCheck::on(const Fact& fact, Time) {
  std::visit([this](const auto& kind) { on(kind); }, fact);
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
  std::erase_if(refused_[fact.gateway], [&](const AnswerKey& refusal) {
    const auto& [call, instance, attempt, when] = refusal;
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
  const AnswerKey key{reply.call, reply.instance, reply.attempt, reply.answered};
  const bool known = refused_[fact.gateway].contains(key);
  if (!fact.completion_signal || known || reply.kind != fabric::ReplyKind::final) {
    expect(unchanged(fact) && !fact.refusal_reported,
           "it is not an answer to the call, and has an effect on it", reply);
    return;
  }
  const bool writable =
      gateway::Response::of(reply.text, reply.state, fact.program_awaits).has_value();
  if (!writable || reply.code == fabric::ServiceCode::refused) {
    refused_[fact.gateway].insert(key);
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
  expect(fact.refusal_reported, "it cannot be written, and the gateway does not report this",
         reply);
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
