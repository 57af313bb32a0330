#include "tests/simulation/machine/interpreted_program.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

namespace {

/// The program's messages: before each call, and with each answer.
constexpr std::string_view next_call = "next";
constexpr std::string_view answer_word = "answer ";

/// As in a slow or busy channel.
constexpr std::size_t most_operations = 6;

constexpr std::string_view wrong_cycle =
    "%SysServiceWait\n"
    "#FLUSH CONTINUE\n"
    "#WAIT FOR V.G.SERVICE.REQUEST_STATE == 0\n"
    "M17\n";

}  // namespace

InterpretedProgram::InterpretedProgram(MachineChannel& channel, ProgramBehaviour behaviour,
                                       Agenda& agenda, Party party, History& history, Random random)
    : channel_(channel),
      behaviour_(std::move(behaviour)),
      agenda_(agenda),
      party_(party),
      history_(history),
      random_(random),
      left_(behaviour_.calls) {
  if (behaviour_.waits_for_the_request) {
    channel_.add_program("SysServiceWait.cyc", std::string(wrong_cycle));
  }
}

void InterpretedProgram::start() {
  ++life_;
  active_ = left_ > 0;
  if (!active_) {
    return;
  }
  if (const auto started = channel_.start(write()); !started) {
    history_.violated(fmt::format("{}: the interpreter refuses its program: {}",
                                  channel_.key().to_string(), started.error()));
    return;
  }
  cycle();
}

void InterpretedProgram::stop() {
  active_ = false;
  ++life_;
}

void InterpretedProgram::calm_down() {
  calm_ = true;
  left_ = std::min<std::size_t>(left_, 1);
}

std::string InterpretedProgram::write() {
  std::string text =
      "%seed\n"
      "#VAR\n"
      "  V.P.STATE = 0\n"
      "  V.P.OUT = 0\n"
      "  V.P.WAITS = 0\n"
      "#ENDVAR\n";
  for (std::size_t i = 0; i < left_; ++i) {
    text += write_call(++written_);
  }
  return text + "M30\n";
}

std::string InterpretedProgram::write_call(std::size_t number) {
  if (number == 1 || !random_.chance(behaviour_.repeats_itself)) {
    uuid_ = random_.pick(behaviour_.uuids);
    text_ = fmt::format("{} {}", channel_.key().to_string(), number);
    state_ = 1 + random_.below(3);
  }
  std::string text = fmt::format("#MSG [\"{}\"]\n", next_call);
  if (random_.chance(40)) {
    text += fmt::format(
        "G04 X{:.3f}\n#FLUSH WAIT\n",
        std::chrono::duration<double>(random_.between(1ms, behaviour_.pause + 1ms)).count());
  }
  if (random_.chance(20)) {
    text += fmt::format("G01 X{} F60000\n", random_.below(20));
  }
  const bool impatient = !calm_ && random_.chance(behaviour_.impatient);
  text += fmt::format(
      "V.G.SERVICE.UUID = \"{}\"\n"
      "V.G.SERVICE.REQUEST = \"{}\"\n"
      "V.G.SERVICE.REQUEST_STATE = {}\n"
      "V.P.STATE = 0\n"
      "V.P.OUT = 0\n"
      "V.P.WAITS = 1\n"
      "$WHILE V.P.WAITS == 1\n",
      uuid_, text_, state_);
  text += impatient ? fmt::format(
                          "  L CYCLE [NAME=\"SysServiceWait.cyc\", @P1=V.P.STATE, @P2={}, @P3=7]\n"
                          "  $IF V.G.SERVICE.RESPONSE_STATE == V.P.STATE\n"
                          "    V.P.OUT = 1\n"
                          "  $ENDIF\n",
                          1 + random_.below(static_cast<std::size_t>(behaviour_.patience / 1ms)))
                    : "  L CYCLE [NAME=\"SysServiceWait.cyc\", @P1=V.P.STATE]\n";
  // Where writing REQUEST_STATE clears RESPONSE_STATE, an interim state that ended the wait may be
  // 0 when the program reads it: it waits on. With the mistake, that would hide it.
  text += fmt::format(
      "  V.P.STATE = V.G.SERVICE.RESPONSE_STATE\n"
      "  V.P.WAITS = 0\n"
      "  $IF V.P.STATE >= {} && V.P.STATE <= {}\n"
      "    V.P.WAITS = 1\n"
      "  $ENDIF\n"
      "  $IF V.P.STATE == 0 && {} == 1\n"
      "    V.P.WAITS = 1\n"
      "  $ENDIF\n"
      "  $IF V.P.OUT == 1\n"
      "    V.P.WAITS = 0\n"
      "  $ENDIF\n"
      "$ENDWHILE\n"
      "$IF V.P.OUT == 0\n"
      "  #MSG [\"answer %u %s\", V.G.SERVICE.RESPONSE_STATE, V.G.SERVICE.RESPONSE]\n",
      first_interim, last_interim, behaviour_.waits_for_the_request ? 0 : 1);
  if (impatient && random_.chance(50)) {
    text +=
        "$ELSE\n"
        "  V.G.SERVICE.REQUEST_STATE = 0\n";
  }
  return text + "$ENDIF\n";
}

void InterpretedProgram::cycle() {
  const std::size_t operations = 1 + random_.below(most_operations);
  for (std::size_t i = 0; i < operations && active_ && channel_.active(); ++i) {
    for (const cnc::nc::Event& event : channel_.tick()) {
      if (active_) {
        on(event);
      }
    }
  }
  if (!active_) {
    return;
  }
  if (!channel_.active()) {
    left_ = 0;
    active_ = false;
    return;
  }
  agenda_.after(std::max<Time>(behaviour_.cycle, 1ms), {.parties = std::uint64_t{1} << party_},
                [this, life = life_] {
                  if (life == life_) {
                    cycle();
                  }
                });
}

void InterpretedProgram::on(const cnc::nc::Event& event) {
  if (const auto* message = std::get_if<cnc::nc::MessageEvent>(&event)) {
    on_message(message->text);
  } else if (const auto* aborted = std::get_if<cnc::nc::AbortedEvent>(&event)) {
    history_.violated(fmt::format("{}: its program is aborted: {}", channel_.key().to_string(),
                                  aborted->why.to_string()));
  }
}

void InterpretedProgram::on_message(const std::string& text) {
  if (text == next_call) {
    if (left_ == 0) {
      // It was to end with the call before.
      active_ = false;
      channel_.reset();
      return;
    }
    --left_;
    return;
  }
  std::uint32_t state = 0;
  const char* const begin = text.data() + answer_word.size();
  const auto [rest, error] = std::from_chars(begin, text.data() + text.size(), state);
  ++answered_;
  history_.add(ProgramReleased{channel_.key(), channel_.standing(), channel_.crossed,
                               std::string(rest + 1, text.data() + text.size()), state});
}

}  // namespace millrace::tests::simulation
