#include "cnc/simulator/service_interface.hpp"

#include <algorithm>
#include <utility>

#include "cnc/variables/service_variable.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::simulator {

namespace {

using variables::ServiceVariable;

std::shared_ptr<Variable> add(Family& globals, ServiceVariable which) {
  const ElementType element = variables::is_state(which) ? ElementType::number(Type::uns32)
                                                         : ElementType::text(variables::max_text);
  auto variable = std::make_shared<Variable>(
      Declaration{std::string(variables::name_of(which)), element, Access::read_write});
  globals.add(variable);
  return variable;
}

bool is_zero(const Variable& state) {
  return state.value(Variable::scalar) == nc::Value{0.0};
}

}  // namespace

ServiceInterface::ServiceInterface(Family& globals, ServiceRules rules, Clock clock,
                                   std::function<void(const AnsweredCall&)> on_answered)
    : rules_(rules), clock_(std::move(clock)), on_answered_(std::move(on_answered)) {
  uuid_ = add(globals, ServiceVariable::uuid);
  const auto request = add(globals, ServiceVariable::request);
  request_state_ = add(globals, ServiceVariable::request_state);
  response_state_ = add(globals, ServiceVariable::response_state);
  const auto response = add(globals, ServiceVariable::response);
  if (rules_.kernel_clears_after || rules_.writes_visible_after.count() > 0) {
    for (const auto& variable : {uuid_, request, request_state_, response_state_, response}) {
      const bool clearable = variable == request_state_ && rules_.kernel_clears_after;
      variable->intercept_client_writes([this, clearable](ads::BytesView value, Apply apply) {
        if (clearable && std::ranges::count(value, 0) == std::ssize(value)) {
          return;
        }
        late_writes_.push_back({clock_() + rules_.writes_visible_after, std::move(apply)});
        advance(clock_());
      });
    }
  }
  request_state_->on_write([this](Writer writer) { request_written(writer); });
  response_state_->on_write([this](Writer writer) { response_written(writer); });
}

void ServiceInterface::advance(std::chrono::nanoseconds now) {
  while (!late_writes_.empty() && late_writes_.front().due <= now) {
    const Apply apply = std::move(late_writes_.front().apply);
    late_writes_.pop_front();
    apply();
  }
  if (clears_at_ && *clears_at_ <= now) {
    clears_at_.reset();
    request_state_->clear();
  }
}

void ServiceInterface::reset() {
  pending_.reset();
  if (rules_.reset_clears_states) {
    clear_states();
  }
}

void ServiceInterface::start() {
  if (rules_.start_clears_states) {
    clear_states();
  }
}

void ServiceInterface::clear_states() {
  request_state_->clear();
  response_state_->clear();
}

void ServiceInterface::request_written(Writer writer) {
  if (writer == Writer::program) {
    // A write of any value to REQUEST_STATE sets RESPONSE_STATE to 0 (documented).
    response_state_->clear();
    pending_.reset();
    clears_at_.reset();
    if (!is_zero(*request_state_)) {
      pending_ = {std::get<std::string>(uuid_->value(Variable::scalar)), clock_()};
    }
  } else if (rules_.ads_request_clears_response) {
    response_state_->clear();
  }
}

void ServiceInterface::response_written(Writer writer) {
  if (is_zero(*response_state_)) {
    return;
  }
  if (writer == Writer::ads && rules_.response_clears_request) {
    request_state_->clear();
  }
  if (writer == Writer::ads && rules_.kernel_clears_after) {
    clears_at_ = clock_() + *rules_.kernel_clears_after;
  }
  if (const auto call = std::exchange(pending_, std::nullopt)) {
    on_answered_({++answered_, call->uuid, clock_() - call->since});
  }
}

}  // namespace millrace::cnc::simulator
