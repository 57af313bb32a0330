#include "tests/simulation/machine/scripted_program.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

using gateway::Variable;

ScriptedProgram::ScriptedProgram(MachineChannel& channel, ProgramBehaviour behaviour,
                                 Agenda& agenda, Party party, History& history, Random random)
    : channel_(channel),
      behaviour_(std::move(behaviour)),
      agenda_(agenda),
      party_(party),
      history_(history),
      random_(random),
      left_(behaviour_.calls) {
  channel_.on_ads_write = [this] {
    // The program looks once a cycle; only a change makes a difference.
    if (waiting_ && !looking_) {
      looking_ = true;
      after(random_.between(Time{}, behaviour_.cycle), "look", &ScriptedProgram::look);
    }
  };
}

void ScriptedProgram::start() {
  active_ = true;
  waiting_ = false;
  ++life_;
  after(Time{}, "begin", &ScriptedProgram::begin);
}

void ScriptedProgram::stop() {
  active_ = false;
  waiting_ = false;
  ++life_;
}

void ScriptedProgram::calm_down() {
  calm_ = true;
  left_ = std::min<std::size_t>(left_, 1);
}

bool ScriptedProgram::may_be_stuck() const {
  return hasty_ || (behaviour_.waits_for_text && channel_.state(Variable::request_state) == 0 &&
                    channel_.text(Variable::response).ends_with(in_progress));
}

std::string ScriptedProgram::place() const {
  return fmt::format("{} {} {} {} {} {} {} {} {}", left_, active_, calm_, looking_, waiting_, call_,
                     wait_at_, request_.text, request_.state);
}

void ScriptedProgram::after(Time delay, const char* name, void (ScriptedProgram::*step)()) {
  agenda_.after(delay,
                {.parties = std::uint64_t{1} << party_,
                 .means = agenda_.meaning(channel_.key().to_string(), name),
                 .lives = {.first = &life_}},
                [this, life = life_, step] {
                  if (life == life_) {
                    (this->*step)();
                  }
                });
}

void ScriptedProgram::begin() {
  if (left_ == 0) {
    active_ = false;
    return;
  }
  --left_;
  ++call_;
  // A program that does not look at a state cannot tell.
  hasty_ = behaviour_.waits_for_text && (!behaviour_.services_know || settled_) && call_ > 1 &&
           (channel_.state(Variable::request_state) != 0 ||
            channel_.state(Variable::response_state) == 0 ||
            is_interim(channel_.state(Variable::response_state)));
  const bool again = call_ > 1 && random_.chance(behaviour_.repeats_itself);
  if (!again) {
    request_.uuid = random_.pick(behaviour_.uuids);
    request_.text = fmt::format("{} {}", channel_.key().to_string(), call_);
    request_.state = static_cast<std::uint32_t>(1 + random_.below(3));
  }
  channel_.set(Variable::uuid, request_.uuid);
  after(random_.between(Time{}, behaviour_.cycle), "write_request",
        &ScriptedProgram::write_request);
}

void ScriptedProgram::write_request() {
  channel_.set(Variable::request, request_.text);
  after(random_.between(Time{}, behaviour_.cycle), "write_state", &ScriptedProgram::write_state);
}

void ScriptedProgram::write_state() {
  if (behaviour_.waits_for_text) {
    channel_.set(Variable::response, std::string());
  }
  channel_.set(Variable::request_state, request_.state);
  waiting_ = true;
  looking_ = false;
  wait_at_ = 0;
  if (!calm_ && random_.chance(behaviour_.impatient)) {
    agenda_.after(random_.between(std::min<Time>(1ms, behaviour_.patience), behaviour_.patience),
                  {.parties = std::uint64_t{1} << party_, .timer = true},
                  [this, life = life_, call = call_] {
                    if (life == life_) {
                      lose_patience(call);
                    }
                  });
  }
  if (!calm_ && random_.chance(behaviour_.changes)) {
    agenda_.after(random_.mostly(Time{}, 20ms, 1000ms, 30),
                  {.parties = std::uint64_t{1} << party_, .timer = true},
                  [this, life = life_, call = call_] {
                    if (life == life_) {
                      change(call);
                    }
                  });
  }
}

void ScriptedProgram::change(std::uint64_t call) {
  if (!waiting_ || call != call_ || channel_.state(Variable::request_state) == 0 ||
      channel_.state(Variable::response_state) != wait_at_) {
    return;
  }
  switch (random_.below(3)) {
    case 0:
      request_.uuid = random_.pick(behaviour_.uuids);
      channel_.set(Variable::uuid, request_.uuid);
      break;
    case 1:
      request_.text += '+';
      channel_.set(Variable::request, request_.text);
      break;
    default:
      request_.state = request_.state % 3 + 1;
      wait_at_ = 0;
      channel_.set(Variable::request_state, request_.state);
  }
}

void ScriptedProgram::look() {
  looking_ = false;
  if (behaviour_.waits_for_text) {
    look_at_text();
    return;
  }
  if (!waiting_ || channel_.state(Variable::response_state) == wait_at_) {
    return;
  }
  const std::uint32_t state = channel_.state(Variable::response_state);
  if (is_interim(state)) {
    // L CYCLE [NAME="SysServiceWait.cyc", @P1=state]
    wait_at_ = state;
    return;
  }
  if (state == 0) {
    // Between the last two writes of an answer that follows an interim one: it waits on.
    return;
  }
  waiting_ = false;
  after(random_.chance(50) ? Time{} : behaviour_.cycle, "read_response",
        &ScriptedProgram::read_response);
}

void ScriptedProgram::look_at_text() {
  const std::string text = channel_.text(Variable::response);
  if (waiting_ && !text.empty() && !text.ends_with(in_progress)) {
    waiting_ = false;
    read_response();
  }
}

void ScriptedProgram::read_response() {
  ++answered_;
  settled_ = is_settlement(channel_.text(Variable::response));
  history_.add(ProgramReleased{
      channel_.key(), channel_.standing(), channel_.crossed, channel_.text(Variable::response),
      channel_.state(Variable::response_state), behaviour_.waits_for_text});
  next();
}

void ScriptedProgram::lose_patience(std::uint64_t call) {
  if (!waiting_ || call != call_) {
    return;
  }
  waiting_ = false;
  history_.note(channel_.key().to_string(), "program has waited long enough");
  if (random_.chance(50)) {
    channel_.set(Variable::request_state, std::uint32_t{0});
  }
  next();
}

void ScriptedProgram::next() {
  after(random_.chance(30) ? Time{} : random_.between(Time{}, behaviour_.pause), "begin",
        &ScriptedProgram::begin);
}

}  // namespace millrace::tests::simulation
