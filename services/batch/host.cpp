#include "services/batch/host.hpp"

#include <exception>

#include "services/batch/call.hpp"
#include "services/batch/catalog.hpp"

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

Host::Host(sdk::ServiceOptions base, base::program::Log log)
    : base_(std::move(base)), log_(std::move(log)) {}

Host::~Host() {
  // Stops all at once, then waits for each.
  for (auto& [uuid, served] : services_) {
    served.service->stop();
  }
}

void Host::serve(const std::vector<Script>& scripts) {
  std::vector<Script> before;
  before.reserve(services_.size());
  for (const auto& [uuid, served] : services_) {
    before.push_back(served.script);
  }
  for (const Script& script : absent(scripts)) {
    log_->warn("{}", absence_of(script));
  }
  const Changes todo = changes(before, present(scripts));
  for (const std::string& uuid : todo.stop) {
    stop(uuid);
  }
  for (const Script& script : todo.start) {
    start(script);
  }
  for (const Script& script : todo.update) {
    Served& served = services_.at(script.registration.uuid);
    served.script = script;
    served.current->set(script);
    log_->info("{} runs {} with the new configuration from now on", script.registration.name,
               script.program.string());
  }
}

void Host::start(const Script& script) {
  const Registration& registration = script.registration;
  sdk::ServiceOptions options = base_;
  options.uuid = registration.uuid;
  options.name = registration.name;
  options.description = registration.description;
  options.channels = registration.channels;
  options.delivery = registration.delivery;
  options.concurrency = registration.concurrency;
  auto current = std::make_shared<CurrentScript>(script);
  try {
    auto service = std::make_unique<sdk::Service>(options, answering(current, log_), log_);
    services_.insert_or_assign(
        registration.uuid,
        Served{.script = script, .current = std::move(current), .service = std::move(service)});
    log_->info("{} serves {} with {}", registration.name, registration.uuid,
               script.program.string());
  } catch (const std::exception& error) {
    log_->error("{} cannot serve {}: {}", registration.name, registration.uuid, error.what());
  }
}

void Host::stop(const std::string& uuid) {
  auto node = services_.extract(uuid);
  Served& served = node.mapped();
  log_->info("{} has stopped serving {}", served.script.registration.name, uuid);
  served.service->stop();
  leaving_.emplace_back([service = std::move(served.service)] { service->wait(); });
}

}  // namespace millrace::services::batch
