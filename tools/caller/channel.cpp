#include "tools/caller/channel.hpp"

#include <random>

#include <fmt/format.h>

namespace millrace::tools::caller {

std::string unique_machine(std::string_view prefix) {
  std::random_device source;
  return fmt::format("{}.{:08x}", prefix, source());
}

std::optional<std::string> reason_taken(const bus::FabricModel& live,
                                        const fabric::ChannelKey& key) {
  for (const auto& [channel, status] : live.channels()) {
    if (channel.machine == key.machine) {
      return fmt::format(
          "a gateway serves machine '{}' on this fabric: a call in {} could replace one of its "
          "calls; choose a machine name that no gateway serves",
          key.machine, key.to_string());
    }
  }
  return std::nullopt;
}

}  // namespace millrace::tools::caller
