#include "fabric/words.hpp"

#include <array>
#include <string>

#include <fmt/format.h>

#include "fabric/data.hpp"

namespace millrace::fabric {

namespace {

template <typename Enum, std::size_t size>
std::string_view pick(const std::array<std::string_view, size>& names, Enum value) {
  const auto index = static_cast<std::size_t>(value);
  return index < size ? names.at(index) : unknown_word(static_cast<std::uint8_t>(index));
}

}  // namespace

std::string_view unknown_word(std::uint8_t number) {
  static const auto words = [] {
    std::array<std::string, 256> all;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all.at(i) = fmt::format("unknown ({})", i);
    }
    return all;
  }();
  return words.at(number);
}

std::string_view name_of(ReplyKind kind) {
  return pick<ReplyKind, 3>({"interim", "final", "declined"}, kind);
}

std::string_view name_of(ServiceCode code) {
  return pick<ServiceCode, 4>({"ok", "failed", "repeated", "refused"}, code);
}

std::string_view name_of(Delivery delivery) {
  return pick<Delivery, 2>({"at-least-once", "at-most-once"}, delivery);
}

std::string_view name_of(CompletionSignal completion_signal) {
  return pick<CompletionSignal, 2>({"response-state", "response"}, completion_signal);
}

std::string_view name_of(ChannelState state) {
  return pick<ChannelState, 7>(
      {"link down", "idle", "unserved", "waiting", "running", "answering", "held"}, state);
}

std::string_view name_of(JournalState state) {
  return pick<JournalState, 4>({"not known", "kept", "none", "not writable"}, state);
}

std::string_view name_of(WatchMode mode) {
  return pick<WatchMode, 4>({"none", "polled", "partly pushed", "pushed"}, mode);
}

std::string_view name_of(EventKind kind) {
  return pick<EventKind, 11>({"seen", "unserved", "dispatched", "interim", "replied", "written",
                              "withdrawn", "lost", "late", "refused", "held"},
                             kind);
}

std::string_view name_of(CommandKind kind) {
  return pick<CommandKind, 4>({"answer", "retry", "drain", "ping"}, kind);
}

std::string_view name_of(ValueType type) {
  return pick<ValueType, 10>({"UNKNOWN", "BOOLEAN", "SGN08", "UNS08", "SGN16", "UNS16", "SGN32",
                              "UNS32", "REAL64", "STRING"},
                             type);
}

std::string_view name_of(Quality quality) {
  return pick<Quality, 3>({"good", "stale", "refused"}, quality);
}

std::string_view name_of(ProgramEventKind kind) {
  return pick<ProgramEventKind, 6>({"started", "ended", "aborted", "reset", "on hold", "resumed"},
                                   kind);
}

std::optional<Delivery> parse_delivery(std::string_view word) {
  for (const Delivery delivery : {Delivery::at_least_once, Delivery::at_most_once}) {
    if (word == name_of(delivery)) {
      return delivery;
    }
  }
  return std::nullopt;
}

std::optional<CompletionSignal> parse_completion_signal(std::string_view word) {
  for (const CompletionSignal completion_signal :
       {CompletionSignal::response_state, CompletionSignal::response}) {
    if (word == name_of(completion_signal)) {
      return completion_signal;
    }
  }
  return std::nullopt;
}

}  // namespace millrace::fabric
