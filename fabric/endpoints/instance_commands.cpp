#include "fabric/endpoints/instance_commands.hpp"

#include <fmt/format.h>

namespace millrace::fabric::endpoints {

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
