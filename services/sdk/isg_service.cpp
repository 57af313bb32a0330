#include "services/sdk/isg_service.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "base/program/barrier.hpp"
#include "base/program/log.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/isg_settings.hpp"
#include "services/sdk/stop_signals.hpp"

namespace sdk = millrace::services::sdk;
namespace program = millrace::base::program;

namespace {

/// A CNC string with its NUL.
constexpr std::size_t buffer_size = millrace::fabric::max_text + 1;

/// Runs the service function on buffers of the vendor's size.
using Function =
    std::function<ISG_SERVICE_CODE(ISG_SERVICE*, char*, ADS_UINT32, char*, size_t, ADS_UINT32*)>;

/// The signals that end the process, without those that it handles itself or that are ignored: a
/// shell script starts a command before an '&' with SIGINT ignored.
std::vector<int> signals_left_alone() {
  std::vector<int> alone;
  for (const int signal : {SIGTERM, SIGINT}) {
    struct sigaction action {};
    ::sigaction(signal, nullptr, &action);
    if (action.sa_handler == SIG_DFL) {
      alone.push_back(signal);
    }
  }
  return alone;
}

/// The user's name for the service's process.
std::string program_name() {
  return program_invocation_short_name;
}

/// The frame of each function of the C interface: no exception may leave it.
template <typename Result, typename Work>
Result guarded(const char* function, Result failed, const Work& work) noexcept {
  Result result = failed;
  program::contain(function, [&] { result = work(); });
  return result;
}

template <typename Work>
ISG_SERVICE_CODE guarded(const char* function, const Work& work) noexcept {
  return guarded(function, ISG_SERVICE_CODE{ISG_SERVICE_CODE_FAILED}, work);
}

}  // namespace

/// The object behind an ISG_SERVICE. C names types, not namespaces.
struct millrace_isg_service {
  millrace_isg_service(const sdk::ServiceOptions& options, Function own_function,
                       program::Log own_log)
      : function(std::move(own_function)), log(std::move(own_log)) {
    if (const std::vector<int> alone = signals_left_alone(); !alone.empty()) {
      signals.emplace(log, alone);
    }
    instance.emplace(options, log);
    if (signals) {
      signals->on_stop([this] { instance->drain(); });
    }
  }

  Function function;
  program::Log log;
  std::optional<sdk::Instance> instance;
  std::optional<sdk::StopSignals> signals;
  /// The call that the service function runs for.
  std::shared_ptr<const sdk::Call> current;
  bool left = false;
};

namespace {

sdk::Response run(ISG_SERVICE& service, const sdk::Call& call) {
  std::array<char, buffer_size> request{};
  std::copy_n(call.text().begin(), std::min(call.text().size(), buffer_size - 1), request.begin());
  // Twice the size that the function gets: a write beyond its limit becomes a refused response.
  std::array<char, 2 * buffer_size> response{};
  ADS_UINT32 state = 0;
  const ISG_SERVICE_CODE code = service.state->function(&service, request.data(), call.state(),
                                                        response.data(), buffer_size, &state);
  if (code != ISG_SERVICE_CODE_OK) {
    throw std::runtime_error("the service function returned code " + std::to_string(code));
  }
  return {.text = {response.data(), strnlen(response.data(), response.size())}, .state = state};
}

/// Runs one call to its end.
void answer(ISG_SERVICE& service, const std::shared_ptr<const sdk::Call>& call) {
  service.state->current = call;
  try {
    call->answer(run(service, *call));
  } catch (const std::exception& error) {
    call->fail(error.what());
  } catch (...) {
    call->fail("the service function threw an exception that is not a std::exception");
  }
  service.state->current = nullptr;
}

ISG_SERVICE_CODE report(ISG_SERVICE_CODE code, const std::string& why) {
  program::make_log(program_name())->error("the service cannot start: {}", why);
  return code;
}

ISG_SERVICE_CODE create(const char* uuid, const char* description, Function function,
                        const ISG_SERVICE_CONNECTION* connection, ISG_SERVICE* service) {
  if (uuid == nullptr || description == nullptr || function == nullptr || connection == nullptr ||
      service == nullptr) {
    return report(ISG_SERVICE_CODE_INVALID_ARGUMENT, "a pointer is null");
  }
  service->state = nullptr;
  auto settings = sdk::read_isg_settings([](const char* name) { return std::getenv(name); });
  if (!settings) {
    return report(ISG_SERVICE_CODE_INVALID_ARGUMENT, settings.error());
  }
  settings->options.uuid = uuid;
  settings->options.name = program_name();
  settings->options.description = description;
  try {
    auto log = program::make_log(program_name(), settings->log_level);
    service->state = new millrace_isg_service(settings->options, std::move(function), log);
    log->info("serves {} on domain {} instead of ADS ports {} and {}",
              service->state->instance->identity().uuid, settings->options.domain,
              connection->sda_port, connection->com_port);
  } catch (const std::invalid_argument& error) {
    return report(ISG_SERVICE_CODE_INVALID_ARGUMENT, error.what());
  } catch (const std::exception& error) {
    return report(ISG_SERVICE_CODE_NOT_CONNECTED, error.what());
  }
  return ISG_SERVICE_CODE_OK;
}

bool is_open(const ISG_SERVICE* service) {
  return service != nullptr && service->state != nullptr && !service->state->left;
}

}  // namespace

ISG_SERVICE_CODE isgServiceConnectionCreateADSLocal(int sdaPort, int comPort,
                                                    ISG_SERVICE_CONNECTION* connection) {
  if (connection == nullptr) {
    return ISG_SERVICE_CODE_INVALID_ARGUMENT;
  }
  *connection = {.sda_port = sdaPort, .com_port = comPort};
  return ISG_SERVICE_CODE_OK;
}

ISG_SERVICE_CODE isgServiceCreateVoid(const char* uuid, const char* description,
                                      ISG_SERVICE_FUNCTION_VOID function,
                                      const ISG_SERVICE_CONNECTION* connection,
                                      ISG_SERVICE* service) {
  return guarded("isgServiceCreate", [&] {
    Function with_code;
    if (function != nullptr) {
      with_code = [function](auto... arguments) {
        function(arguments...);
        return ISG_SERVICE_CODE_OK;
      };
    }
    return create(uuid, description, std::move(with_code), connection, service);
  });
}

ISG_SERVICE_CODE isgServiceCreateWithCode(const char* uuid, const char* description,
                                          ISG_SERVICE_FUNCTION function,
                                          const ISG_SERVICE_CONNECTION* connection,
                                          ISG_SERVICE* service) {
  return guarded("isgServiceCreate",
                 [&] { return create(uuid, description, function, connection, service); });
}

ISG_SERVICE_CODE isgServicePoll(ISG_SERVICE* service) {
  if (!is_open(service)) {
    return ISG_SERVICE_CODE_CLOSED;
  }
  return guarded("isgServicePoll", [&] {
    millrace_isg_service& state = *service->state;
    while (const auto call = state.instance->next()) {
      answer(*service, call);
    }
    state.instance->leave();
    state.left = true;
    return ISG_SERVICE_CODE_OK;
  });
}

ISG_SERVICE_CODE isgServicePollOnce(ISG_SERVICE* service, unsigned timeoutMs) {
  if (!is_open(service)) {
    return ISG_SERVICE_CODE_CLOSED;
  }
  return guarded("isgServicePollOnce", [&] {
    const auto call = service->state->instance->next_for(std::chrono::milliseconds(timeoutMs));
    if (call == nullptr) {
      return service->state->instance->drained() ? ISG_SERVICE_CODE_CLOSED
                                                 : ISG_SERVICE_CODE_NO_CALL;
    }
    answer(*service, call);
    return ISG_SERVICE_CODE_OK;
  });
}

ISG_SERVICE_CODE isgServiceStop(ISG_SERVICE* service) {
  if (!is_open(service)) {
    return ISG_SERVICE_CODE_CLOSED;
  }
  return guarded("isgServiceStop", [&] {
    service->state->instance->drain();
    return ISG_SERVICE_CODE_OK;
  });
}

void isgServiceDelete(ISG_SERVICE* service) {
  if (service != nullptr) {
    delete service->state;
    service->state = nullptr;
  }
}

int isgServiceCancelled(const ISG_SERVICE* service) {
  return is_open(service) && service->state->current && service->state->current->cancelled() ? 1
                                                                                             : 0;
}

ISG_SERVICE_CODE isgServiceInterim(ISG_SERVICE* service, const char* text, ADS_UINT32 state) {
  if (!is_open(service) || service->state->current == nullptr) {
    return ISG_SERVICE_CODE_CLOSED;
  }
  if (text == nullptr) {
    return ISG_SERVICE_CODE_INVALID_ARGUMENT;
  }
  return guarded("isgServiceInterim", [&] {
    try {
      service->state->current->interim({.text = text, .state = state});
    } catch (const std::invalid_argument&) {
      return ISG_SERVICE_CODE_INVALID_ARGUMENT;
    }
    return ISG_SERVICE_CODE_OK;
  });
}

const char* isgServiceCodeText(ISG_SERVICE_CODE code) {
  switch (code) {
    case ISG_SERVICE_CODE_OK:
      return "done";
    case ISG_SERVICE_CODE_INVALID_ARGUMENT:
      return "an argument or a setting in the environment makes no sense";
    case ISG_SERVICE_CODE_NOT_CONNECTED:
      return "the fabric cannot be joined";
    case ISG_SERVICE_CODE_NO_CALL:
      return "no call came within the time";
    case ISG_SERVICE_CODE_CLOSED:
      return "the service has left the fabric";
    case ISG_SERVICE_CODE_FAILED:
      return "an internal error; standard error has the details";
    default:
      return "unknown code";
  }
}
