#include "fabric/words.hpp"

#include <array>

namespace millrace::fabric {

namespace {

template <typename Enum, std::size_t size>
std::string_view pick(const std::array<std::string_view, size>& names, Enum value) {
  const auto index = static_cast<std::size_t>(value);
  return index < size ? names.at(index) : "unknown";
}

}  // namespace

std::string_view name_of(ReplyKind kind) {
  return pick<ReplyKind, 3>({"interim", "final", "declined"}, kind);
}

std::string_view name_of(ServiceCode code) {
  return pick<ServiceCode, 4>({"ok", "failed", "repeated", "refused"}, code);
}

std::string_view name_of(Delivery delivery) {
  return pick<Delivery, 2>({"at-least-once", "at-most-once"}, delivery);
}

std::string_view name_of(ChannelState state) {
  return pick<ChannelState, 7>(
      {"link down", "idle", "unserved", "waiting", "running", "answering", "held"}, state);
}

std::string_view name_of(EventKind kind) {
  return pick<EventKind, 11>({"seen", "unserved", "dispatched", "interim", "replied", "written",
                              "withdrawn", "lost", "late", "refused", "held"},
                             kind);
}

std::string_view name_of(CommandKind kind) {
  return pick<CommandKind, 4>({"answer", "retry", "drain", "ping"}, kind);
}

std::optional<Delivery> parse_delivery(std::string_view word) {
  for (const Delivery delivery : {Delivery::at_least_once, Delivery::at_most_once}) {
    if (word == name_of(delivery)) {
      return delivery;
    }
  }
  return std::nullopt;
}

}  // namespace millrace::fabric
