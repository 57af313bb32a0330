#include "services/sdk/call.hpp"

#include <stdexcept>

#include <tl/expected.hpp>

#include "base/program/barrier.hpp"
#include "services/sdk/call_scheduler.hpp"
#include "services/sdk/runner.hpp"

namespace millrace::services::sdk {

Call::Call(fabric::Request request, std::weak_ptr<CallSink> sink, std::stop_token cancelled)
    : request_(std::move(request)), sink_(std::move(sink)), cancelled_(std::move(cancelled)) {}

Call::~Call() {
  base::program::contain("answering a call that its handler dropped",
                         [this] { fail("the service dropped the call without an answer"); });
}

void Call::interim(const Response& response) const {
  if (const std::string refusal = check_text(response.text); !refusal.empty()) {
    throw std::invalid_argument(refusal);
  }
  if (ended_ || cancelled()) {
    // The call may run again, with the same id.
    return;
  }
  if (const auto sink = sink_.lock()) {
    sink->interim(id(), response);
  }
}

void Call::answer(Response response) const {
  end(std::move(response));
}

void Call::fail(const std::string& reason) const {
  end(tl::unexpected(reason));
}

void Call::decline(const std::string& reason) const {
  if (ended_.exchange(true)) {
    return;
  }
  if (const auto sink = sink_.lock()) {
    sink->declined(id(), reason);
  }
}

void Call::end(const Result& result) const {
  if (ended_.exchange(true)) {
    return;
  }
  if (const auto sink = sink_.lock()) {
    sink->finished(id(), result);
  }
}

AsyncHandler as_async(Handler handler) {
  return [handler = std::move(handler)](const std::shared_ptr<const Call>& call) {
    call->answer(handler(*call));
  };
}

}  // namespace millrace::services::sdk
