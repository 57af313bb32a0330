#include "gateway/queues/window.hpp"

#include <variant>

namespace millrace::gateway::queues {

void Window::show(const QueueMessage& message) {
  uuid_ = next_uuid_;
  shown_ = message.number;
  text_ = message.text;
  request_state_ = request_state_of(message.number);
  response_.clear();
  response_state_ = 0;
  cleared_ = false;
}

void Window::set_uuid(const std::string& uuid) {
  next_uuid_ = uuid;
  const bool being_answered = shown_ && (cleared_ || !response_.empty() || response_state_ != 0);
  if (!being_answered) {
    uuid_ = uuid;
  }
}

Snapshot Window::look(ReadSet what) const {
  Snapshot snapshot;
  snapshot.look = what;
  for (const Variable variable : variables_of(what)) {
    switch (variable) {
      case Variable::uuid:
        snapshot.uuid = shown_ ? uuid_ : std::string();
        break;
      case Variable::request:
        snapshot.request = text_;
        break;
      case Variable::request_state:
        snapshot.request_state = request_state_;
        break;
      case Variable::response_state:
        snapshot.response_state = response_state_;
        break;
      case Variable::response:
        snapshot.response = response_;
        break;
    }
  }
  return snapshot;
}

bool Window::write(Variable variable, const Value& value) {
  if (variable == Variable::request_state) {
    request_state_ = std::get<std::uint32_t>(value);
    cleared_ = shown_ && request_state_ == 0;
    return false;
  }
  if (variable == Variable::response) {
    response_ = std::get<std::string>(value);
  } else if (variable == Variable::response_state) {
    response_state_ = std::get<std::uint32_t>(value);
  } else {
    return false;
  }
  if (!shown_ || !cleared_) {
    return false;
  }
  // What the program would have read by now.
  shown_.reset();
  text_.clear();
  cleared_ = false;
  return true;
}

}  // namespace millrace::gateway::queues
