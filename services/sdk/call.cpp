#include "services/sdk/call.hpp"

#include <stdexcept>
#include <utility>

#include <tl/expected.hpp>

#include "base/program/barrier.hpp"
#include "base/text/cp1252.hpp"
#include "services/sdk/call_scheduler.hpp"
#include "services/sdk/runner.hpp"

namespace millrace::services::sdk {

Call::Call(fabric::Request request, std::weak_ptr<CallSink> sink, std::stop_token cancelled)
    : request_(std::move(request)), sink_(std::move(sink)), cancelled_(std::move(cancelled)) {}

std::string Call::utf8() const {
  return base::text::to_utf8(text());
}

Response Response::utf8(std::string_view text, std::uint32_t state) {
  auto bytes = base::text::to_cp1252(text);
  if (!bytes) {
    throw std::invalid_argument("the service's answer: " + bytes.error());
  }
  return {.text = std::move(*bytes), .state = state};
}

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
  if (const auto sink = end()) {
    sink->finished(id(), std::move(response));
  }
}

void Call::fail(const std::string& reason) const {
  if (const auto sink = end()) {
    sink->finished(id(), tl::unexpected(reason));
  }
}

void Call::decline(const std::string& reason) const {
  if (const auto sink = end()) {
    sink->declined(id(), reason);
  }
}

std::shared_ptr<CallSink> Call::end() const {
  return ended_.exchange(true) ? nullptr : sink_.lock();
}

AsyncHandler as_async(Handler handler) {
  return [handler = std::move(handler)](const std::shared_ptr<const Call>& call) {
    call->answer(handler(*call));
  };
}

AsyncHandler guarded(AsyncHandler handler) {
  return [handler = std::move(handler)](const std::shared_ptr<const Call>& call) {
    try {
      handler(call);
    } catch (const std::exception& error) {
      call->fail(error.what());
    } catch (...) {
      call->fail("the service threw an exception that is not a std::exception");
    }
  };
}

}  // namespace millrace::services::sdk
