#include "services/batch/answering.hpp"

#include "services/batch/call.hpp"

namespace millrace::services::batch {

namespace {

CallInfo info(const sdk::Call& call) {
  return {.request = call.text(),
          .state = call.state(),
          .id = call.id().to_string(),
          .attempt = call.attempt(),
          .machine = call.channel().machine,
          .channel = call.channel().channel,
          .replayed = call.replayed()};
}

sdk::Response answer(const Script& script, const sdk::Call& call, spdlog::logger& log) {
  const auto command = command_for(script, info(call));
  if (!command) {
    return command.error();
  }
  const Ended ended = run(*command, limits_for(script), [&] { return call.cancelled(); });
  Verdict result = verdict(script, ended);
  if (!result.remark.empty()) {
    log.warn("call {}: {} {}", call.id().to_string(), script.registration.name, result.remark);
  }
  return result.answer;
}

}  // namespace

Script CurrentScript::get() const {
  const std::lock_guard guard(lock_);
  return script_;
}

void CurrentScript::set(Script script) {
  const std::lock_guard guard(lock_);
  script_ = std::move(script);
}

sdk::Handler answering(std::shared_ptr<const CurrentScript> script, base::program::Log log) {
  return [script = std::move(script), log = std::move(log)](const sdk::Call& call) {
    return answer(script->get(), call, *log);
  };
}

}  // namespace millrace::services::batch
