#include "services/sdk/testing/fake_call.hpp"

#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/program/log.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/runner.hpp"
#include "services/sdk/testing/request.hpp"

namespace millrace::services::sdk::testing {

struct FakeCall::Impl final : fabric::endpoints::ReplyPublisher {
  Impl(fabric::Request own_request, const ServiceOptions& options)
      : request(complete(std::move(own_request))),
        runner(std::make_shared<Runner>(scheduler_options(options, request.assigned, false),
                                        base::program::no_log(), InlineHandler{})) {
    runner->set_endpoint(this);
    runner->on_request(request);
    call = runner->next(std::chrono::steady_clock::now());
  }
  ~Impl() override {
    call.reset();
    runner->set_endpoint(nullptr);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  tl::expected<void, std::string> publish(const fabric::Reply& reply) override {
    const std::lock_guard guard(lock);
    if (reply.kind == fabric::ReplyKind::interim) {
      interims.push_back({.text = reply.text, .state = reply.state});
    } else {
      last = reply;
    }
    return {};
  }

  const fabric::Request request;
  const std::shared_ptr<Runner> runner;
  std::shared_ptr<const Call> call;
  mutable std::mutex lock;
  std::vector<Response> interims;
  std::optional<fabric::Reply> last;
};

FakeCall::FakeCall(fabric::Request request, const ServiceOptions& options)
    : impl_(std::make_unique<Impl>(std::move(request), options)) {}

FakeCall::~FakeCall() = default;

FakeCall::operator const Call&() const {
  if (impl_->call == nullptr) {
    throw std::logic_error("the call was run before");
  }
  return *impl_->call;
}

void FakeCall::cancel() {
  impl_->runner->on_withdrawn(key_of(impl_->request));
}

std::optional<fabric::Reply> FakeCall::run(const Handler& handler,
                                           std::chrono::milliseconds limit) {
  return run(as_async(handler), limit);
}

std::optional<fabric::Reply> FakeCall::run(const AsyncHandler& handler,
                                           std::chrono::milliseconds limit) {
  if (impl_->call == nullptr) {
    throw std::logic_error("the call was run before");
  }
  // Without an own reference: a handler that drops the call ends it.
  guarded(handler)(std::exchange(impl_->call, nullptr));
  const auto end = std::chrono::steady_clock::now() + limit;
  while (impl_->runner->load().status.running > 0) {
    if (std::chrono::steady_clock::now() > end) {
      throw std::runtime_error(
          fmt::format("the handler has not answered the call within {} ms", limit.count()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const std::lock_guard guard(impl_->lock);
  return impl_->last;
}

std::vector<Response> FakeCall::interims() const {
  const std::lock_guard guard(impl_->lock);
  return impl_->interims;
}

}  // namespace millrace::services::sdk::testing
