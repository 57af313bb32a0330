// Samples of a small fabric: machine "press" of the gateway 99, and what else a test needs.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "fabric/observer/entry.hpp"

namespace millrace::fabric::plant::samples {

inline const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
inline constexpr Time noon{std::chrono::hours(493'000)};

inline InstanceId id(std::uint8_t byte) {
  InstanceId all;
  all.bytes.fill(byte);
  return all;
}

inline observer::Entry entry(observer::Sample sample, Time at = noon) {
  return {.at = at, .sample = std::move(sample)};
}

inline MachineStatus machine_status(const std::string& name, bool connected, Time since = noon) {
  return {.machine = name,
          .gateway = id(99),
          .connected = connected,
          .since = since,
          .reason = connected ? "" : "no route",
          .host = "vm"};
}
inline observer::Entry machine(const std::string& name, bool connected, Time since = noon) {
  return entry(machine_status(name, connected, since));
}
inline observer::Entry gone_machine(const std::string& name, std::uint8_t gateway = 99) {
  return entry(MachineStatus{.machine = name, .gateway = id(gateway), .since = noon, .gone = true});
}

inline ChannelStatus channel_status(std::uint16_t number, ChannelState state,
                                    const std::string& uuid = "", Time since = noon,
                                    Message reason = {}) {
  return {.key = {"press", number},
          .state = state,
          .since = since,
          .uuid = uuid,
          .reason = std::move(reason)};
}
inline observer::Entry channel(std::uint16_t number, ChannelState state,
                               const std::string& uuid = "", Time since = noon,
                               Message reason = {}) {
  return entry(channel_status(number, state, uuid, since, std::move(reason)));
}

inline observer::Entry instance(std::uint8_t byte, const std::string& name, bool draining = false) {
  observer::InstanceNews news{.identity = {.id = id(byte)}};
  news.identity.uuid = square_root;
  news.identity.name = name;
  news.identity.host = "vm";
  news.identity.draining = draining;
  return entry(news);
}
inline observer::Entry instance_gone(std::uint8_t byte, Time at) {
  return entry(
      observer::InstanceNews{.change = observer::Change::gone, .identity = {.id = id(byte)}}, at);
}

inline observer::Entry instance_silent(std::uint8_t byte, Time at) {
  return entry(
      observer::InstanceNews{.change = observer::Change::silent, .identity = {.id = id(byte)}}, at);
}

inline observer::Entry program(std::uint16_t number, ProgramEventKind kind,
                               std::uint32_t error = 455) {
  return entry(ProgramEvent{.key = {"press", number},
                            .kind = kind,
                            .at = noon,
                            .started = noon - std::chrono::seconds(5),
                            .program = "good.nc",
                            .error = kind == ProgramEventKind::aborted ? error : 0});
}

inline Alarm alarm_of(std::uint8_t responder, const std::string& kind, AlarmLevel level,
                      const std::string& subject = "") {
  return {.key = {id(responder), kind, subject},
          .level = level,
          .text = "disk full",
          .advice = "free space",
          .since = noon,
          .program = "archiver",
          .host = "vm",
          .pid = 7};
}
inline observer::Entry alarm(std::uint8_t responder, const std::string& kind, AlarmLevel level,
                             const std::string& subject = "") {
  return entry(observer::AlarmNews{.alarm = alarm_of(responder, kind, level, subject)});
}

}  // namespace millrace::fabric::plant::samples
