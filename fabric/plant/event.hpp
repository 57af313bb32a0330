// What has happened on a fabric: each change of the state of a process, a link, a call or an NC
// program. Pure.
//   if (const auto event = event_of(entry, plant)) …
//   plant.add(entry);
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/plant/plant.hpp"

namespace millrace::fabric::plant {

struct PlantEvent {
  enum class Kind : std::uint8_t {
#define MILLRACE_EVENT_KIND(kind, name) kind,
#include "fabric/plant/event_kinds.def"
#undef MILLRACE_EVENT_KIND
  };
  /// When it happened by the account of its source; else when the observer received it.
  Time at{};
  Kind kind = Kind::problem;
  /// For a gateway, all of its machines that changed with it.
  std::vector<std::string> machines{};
  /// 0 if no channel is concerned.
  std::uint16_t channel = 0;
  CallId call{};
  std::string uuid{};
  /// Of the instance, the process, the NC program or what was acknowledged.
  Message name{};
  std::string host{};
  std::uint32_t pid = 0;
  /// Which instance, gateway or program.
  InstanceId who{};
  /// The instance that ended or fell silent was the last of its service.
  bool last = false;
  /// Of the controller, for an NC program that was aborted; 0 if it gave none.
  std::uint32_t error = 0;
  /// The reason, or who did it.
  Message text{};
};

/// "instance started", "call held", …
std::string_view name_of(PlantEvent::Kind kind);

/// What `entry` changes in the plant that does not have it yet; nullopt if nothing of interest.
/// Two gateways may report one event: both are returned.
std::optional<PlantEvent> event_of(const observer::Entry& entry, const Plant& before);

}  // namespace millrace::fabric::plant
