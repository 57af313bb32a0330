#include "gateway/queues/queue_service_interface.hpp"

#include <algorithm>
#include <variant>

namespace millrace::gateway::queues {

void QueueServiceInterface::show(const QueueMessage& message) {
  uuid_ = next_uuid_;
  shown_ = message.number;
  text_ = message.text;
  request_state_ = request_state_of(message.number);
  response_.clear();
  response_state_ = 0;
  renamed_ = false;
}

void QueueServiceInterface::set_uuid(const std::string& uuid) {
  next_uuid_ = uuid;
  const bool being_answered =
      shown_ && (request_state_ == 0 || !response_.empty() || response_state_ != 0);
  if (!being_answered) {
    renamed_ = renamed_ || (shown_ && uuid_ != uuid);
    uuid_ = uuid;
  }
}

bool QueueServiceInterface::shows_uuid(ReadSet what) {
  return std::ranges::count(variables_of(what), Variable::uuid) > 0;
}

ServiceSnapshot QueueServiceInterface::snapshot(ReadSet what) const {
  ServiceSnapshot snapshot;
  snapshot.set = what;
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

bool QueueServiceInterface::write(const Write& write) {
  if (renamed_) {
    return false;
  }
  if (const auto* state = std::get_if<std::uint32_t>(&write.value)) {
    (write.variable == Variable::request_state ? request_state_ : response_state_) = *state;
  } else {
    response_ = std::get<std::string>(write.value);
  }
  if (!write.releases || !shown_) {
    return false;
  }
  // The NC program would have read it by now.
  shown_.reset();
  text_.clear();
  request_state_ = 0;
  return true;
}

}  // namespace millrace::gateway::queues
