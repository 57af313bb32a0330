// Entries of a small fabric, for tests of commands.
#pragma once

#include "fabric/plant/plant.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::commands::tests {

using recording::tests::at;
using recording::tests::square_root;

inline fabric::InstanceId instance(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

inline recording::Entry news(std::uint8_t byte, const std::string& name,
                             const std::string& uuid = square_root,
                             recording::Change change = recording::Change::ready) {
  recording::InstanceNews what{.change = change, .identity = {.id = instance(byte)}};
  what.identity.uuid = uuid;
  what.identity.name = name;
  what.identity.host = "vm";
  what.identity.concurrency = 2;
  return {.at = at(0), .sample = what};
}

inline recording::Entry load(const fabric::InstanceStatus& status) {
  return {.sample = status};
}

inline recording::Entry machine(const std::string& name, bool connected,
                                const std::string& host = "vm") {
  return {.sample = fabric::MachineStatus{.machine = name,
                                          .gateway = instance(99),
                                          .connected = connected,
                                          .since = at(0),
                                          .reason = connected ? "" : "no route",
                                          .host = host}};
}

inline recording::Entry channel(std::uint16_t number, fabric::ChannelState state,
                                const std::string& uuid = "", fabric::Time since = at(0)) {
  return {.sample = fabric::ChannelStatus{
              .key = {"press", number}, .state = state, .since = since, .uuid = uuid}};
}

}  // namespace millrace::tools::commands::tests
