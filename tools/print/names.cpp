#include "tools/print/names.hpp"

#include <array>

namespace millrace::tools::print {

namespace {

template <typename Enum, std::size_t size>
std::string_view pick(const std::array<std::string_view, size>& names, Enum value) {
  const auto index = static_cast<std::size_t>(value);
  return index < size ? names.at(index) : "unknown";
}

}  // namespace

std::string_view name_of(fabric::ReplyKind kind) {
  return pick<fabric::ReplyKind, 2>({"interim", "final"}, kind);
}

std::string_view name_of(fabric::ServiceCode code) {
  return pick<fabric::ServiceCode, 4>({"ok", "failed", "repeated", "refused"}, code);
}

std::string_view name_of(fabric::ChannelState state) {
  return pick<fabric::ChannelState, 7>(
      {"link down", "idle", "unserved", "waiting", "running", "answering", "held"}, state);
}

std::string_view name_of(fabric::EventKind kind) {
  return pick<fabric::EventKind, 11>({"seen", "unserved", "dispatched", "interim", "replied",
                                      "written", "withdrawn", "lost", "late", "refused", "held"},
                                     kind);
}

std::string_view name_of(fabric::Delivery delivery) {
  return pick<fabric::Delivery, 2>({"at least once", "at most once"}, delivery);
}

std::string_view name_of(fabric::CommandKind kind) {
  return pick<fabric::CommandKind, 4>({"answer", "retry", "drain", "ping"}, kind);
}

std::string_view name_of(recording::Change change) {
  return pick<recording::Change, 3>({"ready", "changed", "gone"}, change);
}

}  // namespace millrace::tools::print
