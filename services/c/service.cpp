// Services and their calls.
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <stop_token>
#include <thread>
#include <vector>

#include "base/program/barrier.hpp"
#include "fabric/channel_scope.hpp"
#include "services/c/participant.hpp"
#include "services/sdk/call_scheduler.hpp"

namespace millrace::services::c {

namespace {

std::chrono::milliseconds limit_of(std::uint32_t timeout_ms) {
  return std::chrono::milliseconds(timeout_ms);
}

template <typename Value>
Value choice(std::int32_t given, Value zero, Value other, const char* what) {
  if (given != 0 && given != 1) {
    throw Error(MILLRACE_INVALID, fmt::format("{} is {}; expected 0 or 1", what, given));
  }
  return given == 0 ? zero : other;
}

std::vector<fabric::ChannelScope> channels_of(const char* text) {
  std::vector<fabric::ChannelScope> channels;
  std::istringstream words{string_or(text)};
  for (std::string word; words >> word;) {
    const auto scope = fabric::parse_channel_scope(word);
    if (!scope) {
      throw Error(MILLRACE_INVALID, fmt::format("channels: {}", scope.error()));
    }
    channels.push_back(*scope);
  }
  return channels;
}

std::uint32_t in_range(std::uint32_t given, const char* what) {
  if (given > sdk::max_concurrency) {
    throw Error(MILLRACE_INVALID,
                fmt::format("{} is {}; expected 1 to {}", what, given, sdk::max_concurrency));
  }
  return given == 0 ? 1 : given;
}

sdk::ServiceOptions options_of(const millrace_service_options& given,
                               const Participant& participant) {
  if (given.uuid == nullptr) {
    throw Error(MILLRACE_INVALID, "millrace_service_options: uuid is NULL");
  }
  return {.uuid = given.uuid,
          .name = string_or(given.name, participant.join().name),
          .description = string_or(given.description),
          .version = string_or(given.version),
          .channels = channels_of(given.channels),
          .delivery = choice(given.delivery, fabric::Delivery::at_least_once,
                             fabric::Delivery::at_most_once, "delivery"),
          .completion_signal = choice(given.completion, fabric::CompletionSignal::response_state,
                                      fabric::CompletionSignal::response, "completion"),
          .concurrency = in_range(given.concurrent_calls, "concurrent_calls"),
          .error_state = given.error_state == 0 ? sdk::default_error_state : given.error_state,
          .participant = participant.shared()};
}

}  // namespace

}  // namespace millrace::services::c

namespace c = millrace::services::c;
namespace sdk = millrace::services::sdk;
namespace fabric = millrace::fabric;

struct millrace_call {
  millrace_call(std::shared_ptr<const sdk::Call> own_call,
                fabric::CompletionSignal own_completion_signal)
      : call(std::move(own_call)),
        completion_signal(own_completion_signal),
        id(call->id().to_string()) {
    info = {.size = sizeof info,
            .text = call->text().c_str(),
            .text_length = call->text().size(),
            .state = call->state(),
            .uuid = call->uuid().c_str(),
            .machine = call->channel().machine.c_str(),
            .channel = call->channel().channel,
            .attempt = call->attempt(),
            .call_id = id.c_str(),
            .deadline_ns = call->deadline().time_since_epoch().count(),
            .replayed = call->replayed() ? 1 : 0};
  }
  /// Throws Error if the call has ended before, or belongs to the process that forked this one.
  void end() {
    c::check_process(process);
    if (ended.exchange(true)) {
      throw c::Error(MILLRACE_ENDED, fmt::format("call {} was answered or declined before", id));
    }
  }

  const pid_t process = ::getpid();
  const std::shared_ptr<const sdk::Call> call;
  const fabric::CompletionSignal completion_signal;
  const std::string id;
  millrace_call_info info{};
  std::atomic<bool> ended = false;
  std::optional<std::stop_callback<std::function<void()>>> on_cancelled;
};

struct millrace_service {
  millrace_service(std::shared_ptr<c::Participant> own_participant,
                   const millrace_service_options& given)
      : participant(std::move(own_participant)),
        options(c::options_of(given, *participant)),
        handler(given.handler),
        handler_context(given.handler_context),
        instance(std::make_unique<sdk::Instance>(options, participant->log())),
        id(instance->identity().id.to_string()) {
    participant->add(instance->identity().id);
  }
  ~millrace_service() {
    participant->remove(instance->identity().id);
    leave();
    for (std::thread& worker : workers) {
      worker.join();
    }
  }
  millrace_service(const millrace_service&) = delete;
  millrace_service& operator=(const millrace_service&) = delete;

  void start(std::uint32_t threads) {
    for (std::uint32_t i = 0; i < threads; ++i) {
      {
        const std::lock_guard guard(lock);
        ++working;
      }
      try {
        workers.emplace_back([this] { work(); });
      } catch (...) {
        const std::lock_guard guard(lock);
        --working;
        throw;
      }
    }
  }
  void work() {
    while (auto call = instance->next()) {
      millrace::base::program::contain("the handler of a service", [&] {
        handler(new millrace_call(std::move(call), options.completion_signal), handler_context);
      });
    }
    const std::lock_guard guard(lock);
    --working;
    worked.notify_all();
  }
  void leave() {
    const std::lock_guard guard(leaving);
    instance->leave();
  }
  void check() const { c::check_process(participant->process()); }

  const std::shared_ptr<c::Participant> participant;
  const sdk::ServiceOptions options;
  const millrace_handler handler;
  void* const handler_context;
  const std::unique_ptr<sdk::Instance> instance;
  const std::string id;
  std::mutex leaving;
  std::mutex lock;
  std::condition_variable worked;
  std::uint32_t working = 0;
  std::vector<std::thread> workers;
};

millrace_code millrace_serve(millrace_participant* participant,
                             const millrace_service_options* options, millrace_service** service) {
  return c::guarded([&] {
    c::checked(service, "service") = nullptr;
    auto state = c::state_of(participant);
    const millrace_service_options given = c::read_options(
        c::checked(options, "millrace_service_options"), "millrace_service_options");
    const std::uint32_t threads = c::in_range(given.threads, "threads");
    if (given.handler == nullptr && given.threads != 0) {
      throw c::Error(MILLRACE_INVALID, "threads is set, but handler is NULL");
    }
    auto handle = std::make_unique<millrace_service>(std::move(state), given);
    handle->start(given.handler == nullptr ? 0 : threads);
    *service = handle.release();
  });
}

const char* millrace_service_uuid(const millrace_service* service) {
  return service != nullptr ? service->instance->identity().uuid.c_str() : "";
}

const char* millrace_service_instance(const millrace_service* service) {
  return service != nullptr ? service->id.c_str() : "";
}

millrace_code millrace_next(millrace_service* service, uint32_t timeout_ms, millrace_call** call) {
  return c::guarded([&]() -> millrace_code {
    millrace_service& from = c::checked(service, "service");
    c::checked(call, "call") = nullptr;
    from.check();
    if (from.handler != nullptr) {
      throw c::Error(MILLRACE_INVALID, "the service has a handler, which gets its calls");
    }
    auto next = timeout_ms == MILLRACE_FOREVER ? from.instance->next()
                                               : from.instance->next_for(c::limit_of(timeout_ms));
    if (next != nullptr) {
      *call = new millrace_call(std::move(next), from.options.completion_signal);
      return MILLRACE_OK;
    }
    return from.instance->drained() ? MILLRACE_CLOSED : MILLRACE_NOTHING;
  });
}

millrace_code millrace_drain(millrace_service* service) {
  return c::guarded([&] {
    c::checked(service, "service").check();
    service->instance->drain();
  });
}

millrace_code millrace_wait(millrace_service* service, uint32_t timeout_ms) {
  return c::guarded([&]() -> millrace_code {
    millrace_service& of = c::checked(service, "service");
    of.check();
    if (of.handler == nullptr) {
      throw c::Error(
          MILLRACE_INVALID,
          "the service has no handler: it has drained when millrace_next returns MILLRACE_CLOSED");
    }
    std::unique_lock guard(of.lock);
    const auto drained = [&of] { return of.working == 0; };
    if (timeout_ms == MILLRACE_FOREVER) {
      of.worked.wait(guard, drained);
    } else if (!of.worked.wait_for(guard, c::limit_of(timeout_ms), drained)) {
      return MILLRACE_NOTHING;
    }
    guard.unlock();
    of.leave();
    return MILLRACE_OK;
  });
}

millrace_code millrace_leave(millrace_service* service) {
  return c::guarded([&] {
    c::checked(service, "service").check();
    service->leave();
  });
}

void millrace_service_free(millrace_service* service) {
  if (service != nullptr && service->participant->process() == ::getpid()) {
    delete service;
  }
}

const millrace_call_info* millrace_call_get(const millrace_call* call) {
  return call != nullptr ? &call->info : nullptr;
}

int32_t millrace_call_cancelled(const millrace_call* call) {
  return call != nullptr && call->call->cancelled() ? 1 : 0;
}

millrace_code millrace_call_on_cancelled(millrace_call* call,
                                         void (*function)(millrace_call* call, void* context),
                                         void* context) {
  return c::guarded([&] {
    c::check_process(c::checked(call, "call").process);
    if (function == nullptr || call->on_cancelled) {
      throw c::Error(MILLRACE_INVALID, function == nullptr
                                           ? "the function is NULL"
                                           : "the call has such a function already");
    }
    call->on_cancelled.emplace(call->call->stop_token(), [=] { function(call, context); });
  });
}

millrace_code millrace_call_interim(millrace_call* call, const char* text, size_t text_length,
                                    uint32_t state) {
  return c::guarded([&] {
    c::check_process(c::checked(call, "call").process);
    call->call->interim(
        {.text = std::string(c::text_of(text, text_length, "text")), .state = state});
  });
}

millrace_code millrace_call_answer(millrace_call* call, const char* text, size_t text_length,
                                   uint32_t state) {
  return c::guarded([&] {
    const sdk::Response response{.text = std::string(c::text_of(text, text_length, "text")),
                                 .state = state};
    c::checked(call, "call").end();
    call->call->answer(response);
    if (const std::string refusal = sdk::check_response(response, call->completion_signal);
        !refusal.empty()) {
      throw c::Error(MILLRACE_INVALID, refusal);
    }
  });
}

millrace_code millrace_call_fail(millrace_call* call, const char* reason, size_t reason_length) {
  return c::guarded([&] {
    const std::string text(c::text_of(reason, reason_length, "reason"));
    c::checked(call, "call").end();
    call->call->fail(text);
  });
}

millrace_code millrace_call_decline(millrace_call* call, const char* reason, size_t reason_length) {
  return c::guarded([&] {
    const std::string text(c::text_of(reason, reason_length, "reason"));
    c::checked(call, "call").end();
    call->call->decline(text);
  });
}

void millrace_call_free(millrace_call* call) {
  if (call != nullptr && call->process == ::getpid()) {
    delete call;
  }
}
