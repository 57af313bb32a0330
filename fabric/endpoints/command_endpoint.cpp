#include "fabric/endpoints/command_endpoint.hpp"

#include <optional>

#include <fmt/format.h>

#include "base/recent.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

struct CommandEndpoint::Impl {
  Impl(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
       CommandListener& listener)
      : outcomes(participant, participant.options().fabric),
        commands(participant, executor, participant.options().fabric,
                 [this, &listener](const wire::Taken<Command>& taken) {
                   if (taken.valid && known.use(taken.value.id) == nullptr) {
                     known.put(taken.value.id);
                     listener.on_command(taken.value);
                   }
                 }) {}

  wire::Writer<Outcome> outcomes;
  /// A tool repeats a command for seconds; an operator sends a few in that time.
  base::Recent<InstanceId> known{64};
  wire::Subscription<Command> commands;
};

CommandEndpoint::CommandEndpoint(dds::Participant& participant,
                                 const boost::asio::any_io_executor& executor,
                                 CommandListener& listener)
    : impl_(std::make_unique<Impl>(participant, executor, listener)) {}

CommandEndpoint::~CommandEndpoint() = default;

tl::expected<void, std::string> CommandEndpoint::publish(const Outcome& outcome) {
  return impl_->outcomes.write(outcome);
}

bool is_for(registry::EndpointHandle participant, const Command& command,
            const registry::InstanceRegistry& instances, const GatewayMonitor& gateways) {
  return command.key.machine.empty() ? instances.is_home(participant, command.instance) ||
                                           gateways.is_gateway(participant, command.instance)
                                     : gateways.claims(participant, command.key.machine);
}

InstanceCommands::InstanceCommands(dds::Participant& participant,
                                   const boost::asio::any_io_executor& executor,
                                   InstanceCommandsListener& listener)
    : listener_(listener), end_(participant, executor, *this) {}

void InstanceCommands::on_command(const Command& command) {
  const bool drain = command.kind == CommandKind::drain;
  if (!drain && command.kind != CommandKind::ping) {
    return;
  }
  const std::optional<std::uint32_t> running = listener_.running(command.instance);
  if (!running) {
    return;
  }
  if (drain) {
    listener_.on_drain(command.instance, command.issuer);
  }
  const auto published = end_.publish(
      {.responder = command.instance,
       .command = command.id,
       .done = true,
       .detail = drain ? fmt::format("leaves when the calls it runs ({}) are answered", *running)
                       : fmt::format("runs {} calls", *running),
       .at = std::chrono::system_clock::now()});
  if (!published) {
    listener_.on_unreported(command, published.error());
  }
}

}  // namespace millrace::fabric::endpoints
