// All # commands.
#include <utility>

#include "cnc/nc/run/block.hpp"
#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/format.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;
using values::must;

// #FLUSH stops the motion briefly; the vendor gives no time, this is our choice.
constexpr double flush_stop_seconds = 0.002;
constexpr std::size_t longest_error_string = 23;  // IB/tf5200_error_management/207457163
constexpr long warning_class = 0;
constexpr long error_class = 2;
constexpr long fatal_class = 7;

}  // namespace

Outcome Execution::operator()(const syntax::Flush& flush) {
  if (flush.kind == syntax::FlushKind::wait && state_.search) {
    fail(50748, "#FLUSH WAIT before the block that is searched for");
  }
  const bool waits =
      flush.kind == syntax::FlushKind::wait ||
      (flush.kind == syntax::FlushKind::go_on && state_.flush_continue_waits && !state_.search);
  Queue& queue = state_.around.queue;
  if (flush.kind == syntax::FlushKind::stop) {
    if (queue.full()) {
      return Outcome::again;
    }
    push(state_.around.motion.dwell(flush_stop_seconds));
  }
  queue.flush();
  return waits && !state_.channel_empty() ? Outcome::again : Outcome::done;
}

Outcome Execution::operator()(const syntax::WaitFor& wait) {
  return evaluator_.number(wait.condition) > 0.5 ? Outcome::done : Outcome::again;
}

Outcome Execution::operator()(const syntax::TimeCommand& time) {
  if (state_.around.queue.full()) {
    return Outcome::again;
  }
  const double seconds = evaluator_.number(time.seconds);
  if (!(seconds >= 0)) {
    fail(0, "#TIME takes seconds from 0 on, not " + values::display(seconds));
  }
  push(state_.around.motion.dwell(seconds));
  return Outcome::done;
}

Outcome Execution::operator()(const syntax::TimerCommand& timer) {
  if (state_.awaits_timer) {
    state_.awaits_timer = !state_.channel_empty();
    return state_.awaits_timer ? Outcome::again : Outcome::done;
  }
  const long id = evaluator_.integer(timer.id);
  if (id < 0 || id >= static_cast<long>(Timers::count)) {
    fail(0, "#TIMER: the timers are 0 to 127, there is no " + std::to_string(id));
  }
  const TimerOrder order{timer.action, static_cast<std::size_t>(id)};
  if (!timer.synchronous) {
    carry_out(order, state_.around.timers, tick_.now);
    return Outcome::done;
  }
  if (state_.around.queue.full()) {
    return Outcome::again;
  }
  push(order);
  state_.awaits_timer = timer.action == syntax::TimerAction::read;
  return state_.awaits_timer ? Outcome::again : Outcome::done;
}

Outcome Execution::operator()(const syntax::Declarations& declarations) {
  for (const syntax::Declaration& declaration : declarations.variables) {
    declare(declaration);
  }
  return Outcome::done;
}

void Execution::declare(const syntax::Declaration& declaration) {
  const std::string written = evaluator_.name_of(declaration.variable);
  const ElementName name = split_name(written);
  VariableShape shape{declaration.type, 0, {}};
  if (declaration.type == VariableType::string) {
    const long length =
        declaration.length ? evaluator_.integer(*declaration.length) : syntax::longest_string;
    if (length < 0 || length > syntax::longest_string) {
      fail(0, "the length of a string is 0 to " + std::to_string(syntax::longest_string) +
                  ", not " + std::to_string(length));
    }
    shape.length = static_cast<std::size_t>(length);
  }
  for (const long dimension : name.indices) {
    shape.dimensions.push_back(static_cast<std::size_t>(std::max(dimension, 0L)));
  }
  std::vector<Value> initial;
  for (const syntax::Expression& expression : declaration.initial) {
    initial.push_back(declaration.type == VariableType::string
                          ? evaluator_.evaluate_text(expression)
                          : evaluator_.evaluate(expression));
  }
  must(state_.around.memory.declare(name.variable, shape, initial));
}

Outcome Execution::operator()(const syntax::Deletion& deletion) {
  for (const syntax::Reference& variable : deletion.variables) {
    must(state_.around.memory.erase(evaluator_.name_of(variable)));
  }
  return Outcome::done;
}

Outcome Execution::operator()(const syntax::ForgetMacros& /*forget*/) {
  state_.around.macros.clear();
  return Outcome::done;
}

Outcome Execution::operator()(const syntax::InitExternals& init) {
  for (const syntax::Reference& variable : init.variables) {
    must(tick_.environment.initialise(evaluator_.name_of(variable)));
  }
  return Outcome::done;
}

Outcome Execution::operator()(const syntax::UserError& error) {
  long id = 0;
  long recovery_class = error_class;
  std::string details;
  for (const syntax::ErrorParameter& parameter : error.parameters) {
    const Value value = evaluator_.evaluate_text(parameter.value);
    const long number = parameter.name.front() == 'P' ? 0 : must(values::integer(value));
    const std::string shown = values::display(value);
    if (std::holds_alternative<std::string>(value) && shown.size() > longest_error_string) {
      fail(21462, parameter.name + ": a string of #ERROR has at most 23 characters");
    }
    if (parameter.name == "ID") {
      id = number;
    } else if (parameter.name == "RC") {
      recovery_class = number;
    } else {
      details += ' ' + parameter.name + '=' + shown;
    }
  }
  if (id < 1 || id > 1000) {
    fail(0, "#ERROR: ID is 1 to 1000, not " + std::to_string(id));
  }
  return raise(id, recovery_class, "raised by the program with #ERROR" + details);
}

Outcome Execution::raise(long id, long recovery_class, std::string text) {
  switch (recovery_class) {
    case warning_class:
      warn(std::move(text), static_cast<int>(id));
      return Outcome::done;
    case fatal_class:
      state_.restart_needed = true;
      fail(static_cast<int>(id), std::move(text));
    case error_class:
      fail(static_cast<int>(id), std::move(text));
    default:
      fail(0, "#ERROR: RC is 0, 2 or 7, not " + std::to_string(recovery_class));
  }
}

void Execution::warn(std::string text, int id) {
  tick_.emit(WarningEvent{{state_.place(), id, std::move(text)}});
}

void Execution::note_skipped(const std::string& name) {
  constexpr std::size_t most_notes = 1'000;
  if (state_.skipped.size() < most_notes && state_.skipped.insert(name).second) {
    warn(name + " has no effect on the virtual CNC");
  }
}

Outcome Execution::operator()(const syntax::Skipped& skipped) {
  note_skipped(skipped.name);
  if (skipped.flushes) {
    state_.around.queue.flush();
  }
  return Outcome::done;
}

std::string Execution::text_of(const syntax::FormattedText& text) {
  std::vector<Value> arguments;
  for (const syntax::Expression& expression : text.values) {
    arguments.push_back(evaluator_.evaluate(expression));
  }
  return must(values::format(text.format, arguments));
}

Outcome Execution::operator()(const syntax::Message& message) {
  if (state_.awaited_message) {
    if (!state_.around.messages.acknowledged(*state_.awaited_message)) {
      return Outcome::again;
    }
    state_.awaited_message.reset();
    return Outcome::done;
  }
  if (message.synchronous ? state_.around.queue.full() : state_.around.messages.full()) {
    return Outcome::again;
  }
  MessageEvent event{text_of(message.text), message.receiver, 0, message.acknowledge, message.info};
  if (!message.synchronous) {
    return send(std::move(event));
  }
  push(SynchronousMessage{std::move(event)});
  return Outcome::done;
}

Outcome Execution::send(MessageEvent message) {
  const std::uint64_t number = state_.around.messages.send(message);
  tick_.emit(std::move(message));
  if (state_.around.messages.acknowledged(number)) {
    return Outcome::done;
  }
  state_.awaited_message = number;
  return Outcome::again;
}

Outcome Execution::operator()(const syntax::SaveMessage& save) {
  tick_.emit(SaveEvent{state_.report_file, text_of(save.text), save.time_stamp, save.line_end});
  return Outcome::done;
}

Outcome Execution::operator()(const syntax::ReportFile& file) {
  state_.report_file = must(values::text(evaluator_.evaluate_text(file.name)));
  return Outcome::done;
}

}  // namespace millrace::cnc::nc::run
