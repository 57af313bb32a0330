#include "services/archiver/names.hpp"

namespace millrace::services::archiver {

std::string name_of(fabric::EventKind kind) {
  using fabric::EventKind;
  switch (kind) {
    case EventKind::seen:
      return "seen";
    case EventKind::unserved:
      return "unserved";
    case EventKind::dispatched:
      return "dispatched";
    case EventKind::interim:
      return "interim";
    case EventKind::replied:
      return "replied";
    case EventKind::written:
      return "written";
    case EventKind::withdrawn:
      return "withdrawn";
    case EventKind::lost:
      return "lost";
    case EventKind::late:
      return "late";
    case EventKind::refused:
      return "refused";
    case EventKind::held:
      return "held";
  }
  return "unknown";
}

std::string name_of(fabric::ChannelState state) {
  using fabric::ChannelState;
  switch (state) {
    case ChannelState::link_down:
      return "link_down";
    case ChannelState::idle:
      return "idle";
    case ChannelState::unserved:
      return "unserved";
    case ChannelState::waiting:
      return "waiting";
    case ChannelState::running:
      return "running";
    case ChannelState::answering:
      return "answering";
    case ChannelState::held:
      return "held";
  }
  return "unknown";
}

}  // namespace millrace::services::archiver
