#include "fabric/endpoints/command_endpoint.hpp"

#include <algorithm>
#include <deque>
#include <optional>

#include <fmt/format.h>

#include "fabric/dds/listeners.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

struct CommandEndpoint::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, CommandListener& own_listener)
      : participant(own_participant),
        listener(&own_listener),
        outcomes(own_participant, own_participant.options().fabric) {}

  void open(const boost::asio::any_io_executor& executor);
  void close();
  void drain();
  /// False if it was heard before.
  bool is_new(const InstanceId& command);

  dds::Participant& participant;
  /// Null once the end is closed.
  CommandListener* listener;
  wire::Writer<Outcome> outcomes;
  std::deque<InstanceId> heard;
  // Before the reader that wakes it.
  std::optional<dds::PostOnce> post;
  std::optional<wire::Reader<Command>> commands;
};

void CommandEndpoint::Impl::open(const boost::asio::any_io_executor& executor) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  const dds::Listener on_command(dds_create_listener(nullptr));
  post->listen_for_data(on_command.get());
  commands.emplace(participant, participant.options().fabric, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_command.get()});
}

void CommandEndpoint::Impl::close() {
  listener = nullptr;
  commands.reset();
}

void CommandEndpoint::Impl::drain() {
  // Each callback may close this end.
  while (listener != nullptr) {
    const auto batch = commands->take();
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<Command>& taken : batch) {
      if (listener != nullptr && taken.valid && is_new(taken.value.id)) {
        listener->on_command(taken.value);
      }
    }
  }
}

bool CommandEndpoint::Impl::is_new(const InstanceId& command) {
  // A tool repeats a command for seconds; an operator sends a few in that time.
  constexpr std::size_t remembered = 64;
  if (std::find(heard.begin(), heard.end(), command) != heard.end()) {
    return false;
  }
  heard.push_back(command);
  if (heard.size() > remembered) {
    heard.pop_front();
  }
  return true;
}

CommandEndpoint::CommandEndpoint(dds::Participant& participant,
                                 const boost::asio::any_io_executor& executor,
                                 CommandListener& listener)
    : impl_(std::make_shared<Impl>(participant, listener)) {
  impl_->open(executor);
}

CommandEndpoint::~CommandEndpoint() {
  impl_->close();
}

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
  const auto told = end_.publish(
      {.responder = command.instance,
       .command = command.id,
       .done = true,
       .detail = drain ? fmt::format("leaves when the calls it runs ({}) are answered", *running)
                       : fmt::format("runs {} calls", *running),
       .at = std::chrono::system_clock::now()});
  if (!told) {
    listener_.on_unreported(command, told.error());
  }
}

}  // namespace millrace::fabric::endpoints
