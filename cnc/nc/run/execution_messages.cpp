// All forms of #MSG.
#include <utility>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/format.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

std::string Execution::text_of(const syntax::FormattedText& text) {
  std::vector<Value> arguments;
  for (const syntax::Expression& expression : text.values) {
    arguments.push_back(evaluator_.evaluate(expression));
  }
  return values::must(values::format(text.format, arguments));
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
  state_.report_file = values::must(values::text(evaluator_.evaluate_text(file.name)));
  return Outcome::done;
}

}  // namespace millrace::cnc::nc::run
