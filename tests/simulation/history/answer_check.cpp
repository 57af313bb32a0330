#include "tests/simulation/history/answer_check.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/text.hpp"
#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

std::vector<std::string> AnswerCheck::on(const Fact& fact, Time now) {
  violations_.clear();
  std::visit([&](const auto& one) { on(one, now); }, fact);
  return std::exchange(violations_, {});
}

void AnswerCheck::close(Channel& channel, Time now) {
  for (Stretch& one : channel.stretches) {
    one.until = one.until.value_or(now);
  }
}

void AnswerCheck::on(const ProgramAsked& fact, Time now) {
  Channel& channel = channels_[fact.key];
  close(channel, now);
  for (const Stretch& one : channel.stretches) {
    // A repetition of its previous request: it may get the same answer again.
    if (one.answered_by && one.request == fact.request) {
      finals_.erase(*one.answered_by);
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
                        [&](const Stretch& one) { return one.request == channel.asked; });
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
  const bool stood = std::ranges::any_of(stretches, [&](const Stretch& one) {
    const bool ours = one.request == fact.request && one.from <= look->second.end;
    return ours && (!one.until || *one.until >= look->second.first || one.answered_by == fact.call);
  });
  const bool seems_to_wait =
      channel.wiped && !stretches.empty() && stretches.back().request == fact.request;
  // Where the kernel clears REQUEST_STATE, the answer of a gateway out of hearing looks like an
  // interim one; and a text that releases a program may be any gateway's.
  const auto others = [&](const std::set<GatewayNumber>& writers) {
    return writers.size() > writers.count(fact.gateway);
  };
  const bool answered_unseen = (channel.kernel_clears && others(channel.all_writers)) ||
                               (fact.completion_signal == fabric::CompletionSignal::response &&
                                (others(channel.writers) || others(channel.writers_before)));
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
  const auto stands = [&](const Stretch& one) { return !one.until && one.request == fact.request; };
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
      for (const Stretch& one : channel.stretches) {
        if (one.answered_by && one.request == fact.request) {
          finals_.erase(*one.answered_by);
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
  const auto others = [&](const std::set<GatewayNumber>& writers) {
    return writers.size() > writers.count(fact.gateway);
  };
  // Of two gateways that do not see each other, one has cleared the program's next, equal request:
  // for the other one its RESPONSE, which releases the program, is lost.
  const bool unseen = fact.variable == gateway::Variable::response &&
                      (others(channel.writers) || others(channel.writers_before));
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
  for (Stretch& one : channel.stretches) {
    if (stands(one)) {
      one.until = now;
      one.answered_by = fact.call;
    }
  }
}

/// The answer must be a reply of the instance to this call.
void AnswerCheck::judge_writer(const WriteDone& fact) {
  const gateway::Answer& answer = *fact.answer;
  const auto said = [&](const fabric::Reply& reply) {
    return reply.instance == answer.instance &&
           (answer.text == gateway::printable(reply.text) || answer.text == reply.text ||
            stands_for_a_refused_one(answer.text));
  };
  if (answer.instance != fabric::InstanceId{} && std::ranges::none_of(replies_[fact.call], said)) {
    violations_.push_back(
        fmt::format("I10: {} is answered with \"{}\", which instance {} has not said of it",
                    fact.call.to_string(), answer.text, answer.instance.to_string().substr(0, 8)));
  }
}

void AnswerCheck::on(const Resumed& fact, Time) {
  if (fact.call == fabric::CallId{}) {
    std::erase_if(reads_, [&](const auto& one) { return one.first.first == fact.gateway; });
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

}  // namespace millrace::tests::simulation
