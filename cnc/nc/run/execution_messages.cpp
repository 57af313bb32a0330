// All forms of #MSG.
#include <utility>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/format.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

using values::Result;

Result<std::string> Execution::text_of(const syntax::FormattedText& text) {
  std::vector<Value> arguments;
  for (const syntax::Expression& expression : text.values) {
    auto value = evaluator_.evaluate(expression);
    if (!value) {
      return tl::make_unexpected(value.error());
    }
    arguments.push_back(std::move(*value));
  }
  return values::format(text.format, arguments);
}

Result<Outcome> Execution::operator()(const syntax::Message& message) {
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
  return text_of(message.text).map([&](std::string text) {
    MessageEvent event{std::move(text), message.receiver, 0, message.acknowledge, message.info};
    if (message.synchronous) {
      push(SynchronousMessage{std::move(event)});
      return Outcome::done;
    }
    return send(std::move(event));
  });
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

Result<Outcome> Execution::operator()(const syntax::SaveMessage& save) {
  return text_of(save.text).map([&](std::string text) {
    tick_.emit(SaveEvent{state_.report_file, std::move(text), save.time_stamp, save.line_end});
    return Outcome::done;
  });
}

Result<Outcome> Execution::operator()(const syntax::ReportFile& file) {
  return evaluator_.evaluate_text(file.name).and_then(values::text).map([this](std::string name) {
    state_.report_file = std::move(name);
    return Outcome::done;
  });
}

}  // namespace millrace::cnc::nc::run
