#include "services/c/participant.hpp"

#include <array>
#include <cstdlib>

#include <spdlog/sinks/base_sink.h>

#include "base/program/supervisor.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "services/c/requests.hpp"
#include "services/sdk/isg_settings.hpp"

namespace millrace::services::c {

namespace program = base::program;

namespace {

int level_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
    case spdlog::level::err:
      return MILLRACE_LOG_ERROR;
    case spdlog::level::warn:
      return MILLRACE_LOG_WARN;
    case spdlog::level::info:
      return MILLRACE_LOG_INFO;
    case spdlog::level::debug:
      return MILLRACE_LOG_DEBUG;
    default:
      return MILLRACE_LOG_TRACE;
  }
}

/// Hands lines to the function of the program, one at a time.
class FunctionSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  FunctionSink(millrace_log_function function, void* context)
      : function_(function), context_(context) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string text =
        base::text::safe({message.payload.data(), message.payload.size()}, "\n");
    function_(level_of(message.level), text.c_str(), context_);
  }
  void flush_() override {}

 private:
  millrace_log_function function_;
  void* context_;
};

program::Log make_log(const millrace_participant_options& options, const std::string& name,
                      spdlog::level::level_enum level) {
  if (options.log == nullptr) {
    return program::make_log(name, level);
  }
  auto log = std::make_shared<spdlog::logger>(
      name, std::make_shared<FunctionSink>(options.log, options.log_context));
  log->set_level(level);
  return log;
}

/// Variables of the environment, unless an option replaces them.
class Environment {
 public:
  explicit Environment(const millrace_participant_options& options)
      : options_(options), domain_(std::to_string(options.domain)) {
    constexpr std::array levels{"error", "warn", "info", "debug", "trace"};
    if (options.log_level < 0 || options.log_level > MILLRACE_LOG_TRACE) {
      throw Error(MILLRACE_INVALID, fmt::format("log_level is {}; expected 0 to {}",
                                                options.log_level, MILLRACE_LOG_TRACE));
    }
    if (options.log_level > 0) {
      level_ = levels.at(static_cast<std::size_t>(options.log_level - 1));
    }
  }

  const char* operator()(const char* name) const {
    const std::string_view variable(name);
    const auto given = [name](const char* option) {
      return option != nullptr ? option : std::getenv(name);
    };
    if (variable == "MILLRACE_FABRIC_CONFIG") {
      return given(options_.fabric_config);
    }
    if (variable == "MILLRACE_FABRIC") {
      return given(options_.fabric);
    }
    if (variable == "MILLRACE_DOMAIN") {
      return given(options_.use_domain != 0 ? domain_.c_str() : nullptr);
    }
    if (variable == "MILLRACE_LOG_LEVEL") {
      return given(level_);
    }
    // All others are settings of services, which each service gets in its options.
    return nullptr;
  }

 private:
  const millrace_participant_options& options_;
  std::string domain_;
  const char* level_ = nullptr;
};

sdk::IsgSettings read_settings(const millrace_participant_options& options) {
  auto settings = sdk::read_isg_settings(Environment(options));
  if (!settings) {
    throw Error(MILLRACE_INVALID, settings.error());
  }
  settings->options.name = string_or(options.name, program_invocation_short_name);
  return std::move(*settings);
}

}  // namespace

Participant::Participant(const millrace_participant_options& options)
    : discovers_(options.discovers != 0) {
  const sdk::IsgSettings settings = read_settings(options);
  log_ = make_log(options, settings.options.name, settings.log_level);
  join_ = sdk::join_options(settings.options);
  if (join_.trust) {
    auto trust = std::make_shared<fabric::dds::Trust>(*join_.trust);
    trust->ended = [log = log_, expired = expired_,
                    instances = instances_](const std::string& why) {
      if (expired->exchange(true)) {
        return;
      }
      log->error(
          "{}: from now on no process on the fabric accepts what this one publishes. Put newer "
          "credentials into its folder (`millrace trust renew`, or `issue` under another name "
          "where the certificate was revoked) and start it again",
          why);
      const std::lock_guard guard(instances->lock);
      for (const fabric::InstanceId& instance : instances->all) {
        instances->shared->drain(instance);
      }
    };
    join_.trust = std::move(trust);
  }
  try {
    shared_ = std::make_shared<sdk::SharedParticipant>(
        join_, log_,
        discovers_ ? fabric::dds::Finding::discovers : fabric::dds::Finding::announces);
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(MILLRACE_NOT_CONNECTED, error.what());
  }
  const std::lock_guard guard(instances_->lock);
  instances_->shared = shared_.get();
}

Participant::~Participant() {
  if (requests_) {
    on_loop([this] { requests_.reset(); });
  }
}

void Participant::check_discovers(const char* what) const {
  if (!discovers_) {
    throw Error(
        MILLRACE_INVALID,
        fmt::format("{} needs a participant that discovers the others: set 'discovers' in its "
                    "millrace_participant_options",
                    what));
  }
}

void Participant::add(const fabric::InstanceId& instance) {
  const std::lock_guard guard(instances_->lock);
  instances_->all.insert(instance);
}

void Participant::remove(const fabric::InstanceId& instance) {
  const std::lock_guard guard(instances_->lock);
  instances_->all.erase(instance);
}

Requests& Participant::requests() {
  const std::lock_guard guard(lock_);
  if (!requests_) {
    requests_ = on_loop([this] { return std::make_unique<Requests>(*shared_); });
  }
  return *requests_;
}

std::shared_ptr<Participant> state_of(const millrace_participant* participant) {
  auto state = checked(participant, "participant").state;
  check_process(state->process());
  return state;
}

}  // namespace millrace::services::c

namespace c = millrace::services::c;

millrace_code millrace_join(const millrace_participant_options* options,
                            millrace_participant** participant) {
  return c::guarded([&] {
    c::checked(participant, "participant") = nullptr;
    const millrace_participant_options given =
        options == nullptr ? millrace_participant_options{}
                           : c::read_options(*options, "millrace_participant_options");
    auto handle = std::make_unique<millrace_participant>();
    handle->state = std::make_shared<c::Participant>(given);
    *participant = handle.release();
  });
}

void millrace_participant_free(millrace_participant* participant) {
  // A forked child has no threads that could end.
  if (participant != nullptr && participant->state->process() == ::getpid()) {
    delete participant;
  }
}

uint32_t millrace_domain(const millrace_participant* participant) {
  return participant != nullptr ? participant->state->domain() : 0;
}

int32_t millrace_is_expired(const millrace_participant* participant) {
  return participant != nullptr && participant->state->expired() ? 1 : 0;
}

void millrace_notify_supervisor(const char* lines) {
  if (lines != nullptr) {
    millrace::base::program::notify_supervisor(lines);
  }
}
