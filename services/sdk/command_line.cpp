#include "services/sdk/command_line.hpp"

#include <stdexcept>

#include <fmt/format.h>

#include "base/program/version.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/profile/given_flags.hpp"
#include "fabric/words.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/main.hpp"
#include "services/sdk/shared_participant.hpp"
#include "services/sdk/stop_signals.hpp"

namespace millrace::services::sdk {

namespace program = base::program;

namespace {

std::string title(const ServiceOptions& options) {
  return options.description.empty() ? fmt::format("The millrace service {}", options.name)
                                     : options.description;
}

void add_delivery(CLI::App& app, fabric::Delivery& delivery) {
  using fabric::Delivery;
  app.add_option_function<std::string>(
         "--delivery",
         [&delivery](const std::string& word) {
           delivery = fabric::parse_delivery(word).value_or(delivery);
         },
         "What happens to a call whose instance is lost: at-least-once dispatches it to another "
         "one, at-most-once blocks it for an operator")
      ->check(CLI::IsMember({std::string(name_of(Delivery::at_least_once)),
                             std::string(name_of(Delivery::at_most_once))}))
      ->default_str(std::string(name_of(delivery)))
      ->type_name("POLICY");
}

void add_completion_signal(CLI::App& app, fabric::CompletionSignal& completion_signal) {
  using fabric::CompletionSignal;
  app.add_option_function<std::string>(
         "--completion-signal",
         [&completion_signal](const std::string& word) {
           completion_signal = fabric::parse_completion_signal(word).value_or(completion_signal);
         },
         "Variable that its NC programs wait for: RESPONSE_STATE, or RESPONSE, which is then "
         "written last; the state of a response may then be 0")
      ->check(CLI::IsMember({std::string(name_of(CompletionSignal::response_state)),
                             std::string(name_of(CompletionSignal::response))}))
      ->default_str(std::string(name_of(completion_signal)))
      ->type_name("VARIABLE");
}

std::string ready_line(const Service& service, const ServiceOptions& options) {
  const fabric::InstanceIdentity& identity = service.identity();
  return fmt::format("{} serves {} as {} on domain {}", identity.name, identity.uuid,
                     identity.id.to_string(), options.domain);
}

}  // namespace

ServiceProgram::ServiceProgram(ServiceOptions defaults)
    : options_(std::move(defaults)), app_(title(options_)), fabric_(app_, join_options(options_)) {
  app_.add_option("--uuid", options_.uuid,
                  options_.uuid.empty() ? "UUID that NC programs call (required)"
                                        : "UUID that NC programs call")
      ->capture_default_str();
  app_.add_option("--channel", channels_,
                  "Channels to serve, as MACHINE/N; either part may be *. Default: all");
  app_.add_option("--name", options_.name, "Name of the service in tools and logs")
      ->capture_default_str();
  app_.add_option("--concurrency", options_.concurrency, "Calls that may run at the same time")
      ->check(CLI::Range(1U, max_concurrency))
      ->capture_default_str();
  add_delivery(app_, options_.delivery);
  add_completion_signal(app_, options_.completion_signal);
  program::add_log_level(app_, level_);
  if (options_.version != program::version()) {
    app_.set_version_flag(
        "--version",
        fmt::format("{}{}{} (millrace {})", options_.name, options_.version.empty() ? "" : " ",
                    options_.version, program::version_and_commit()),
        "Print the version and exit");
  }
}

fabric::dds::ParticipantOptions ServiceProgram::join_as(std::string name) const {
  fabric::dds::ParticipantOptions join = join_options(options_);
  join.name = std::move(name);
  return join;
}

std::string ServiceProgram::given_flags() const {
  return fabric::profile::given_flags(fabric_);
}

int ServiceProgram::run(int argc, char** argv, const std::function<Handler()>& make) {
  return run(argc, argv, [&]() -> AsyncHandler { return as_async(make()); });
}

int ServiceProgram::run(int argc, char** argv, const std::function<AsyncHandler()>& make) {
  return program::run(app_, argc, argv, [&] {
    expect_uuid();
    take_channels();
    take_fabric();
    log_ = program::make_log(options_.name, level_);
    std::unique_ptr<Service> service;
    // Created before the service is visible, and destroyed before it.
    StopSignals signals(log_);
    service = open(make());
    signals.on_stop([&] { service->stop(); });
    program::ready(ready_line(*service, options_));
    service->wait();
    alarms_.leave();
    return program::exit_done;
  });
}

std::unique_ptr<Service> ServiceProgram::open(AsyncHandler handler) {
  try {
    ServiceOptions options = options_;
    options.participant = std::make_shared<SharedParticipant>(join_options(options), log_);
    auto service = std::make_unique<Service>(options, std::move(handler), log_);
    alarms_.join(options.participant, service->identity(), log_);
    return service;
  } catch (const std::invalid_argument& error) {
    throw program::UsageError(error.what());
  }
}

void ServiceProgram::expect_uuid() const {
  if (options_.uuid.empty()) {
    throw program::UsageError(
        "--uuid is required: the service has no UUID of its own. Start it with --uuid UUID, the "
        "text that its NC programs write to V.G.SERVICE.UUID (uuidgen makes a new one), or set "
        "ServiceOptions::uuid in its source");
  }
}

void ServiceProgram::take_channels() {
  for (const std::string& text : channels_) {
    const auto scope = fabric::parse_channel_scope(text);
    if (!scope) {
      throw program::UsageError(fmt::format("--channel: {}", scope.error()));
    }
    options_.channels.push_back(*scope);
  }
}

void ServiceProgram::take_fabric() {
  fabric::dds::ParticipantOptions join = fabric_.options();
  options_.domain = join.domain;
  options_.fabric = std::move(join.fabric);
  options_.lease = join.lease;
  options_.configuration = std::move(join.configuration);
  options_.trust = std::move(join.trust);
}

int serve(int argc, char** argv, const ServiceOptions& options, const Handler& handler) {
  return serve(argc, argv, options, as_async(handler));
}

int serve(int argc, char** argv, const ServiceOptions& options, const AsyncHandler& handler) {
  return ServiceProgram(options).run(argc, argv, [&] { return handler; });
}

}  // namespace millrace::services::sdk
