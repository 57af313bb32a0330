#include "tools/commands/look/look.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

LookOptions::LookOptions(CLI::App& command)
    : fabric(command, {.name = "millrace"}), wait(bus::Patience{}.at_least) {
  add_duration(command, "--wait", wait,
               "Listen for at least this time; default 700ms. With trust up to 3s until all "
               "participants are authenticated");
  add_json(command, json);
}

bus::FabricModel LookOptions::look() const {
  bus::Patience patience;
  patience.at_least = std::chrono::ceil<std::chrono::milliseconds>(wait);
  patience.at_most += patience.at_least;
  return bus::take_snapshot(fabric.options(), patience);
}

std::string channels_text(const fabric::InstanceIdentity& identity) {
  std::string text;
  for (const fabric::ChannelScope& scope : identity.channels) {
    text += (text.empty() ? "" : " ") + base::text::safe(fabric::format_channel_scope(scope));
  }
  return text.empty() ? "all" : text;
}

std::string ago(fabric::Time time) {
  if (time == fabric::Time{}) {
    return "-";
  }
  const auto age = std::chrono::system_clock::now() - time;
  // Another host's clock may be ahead.
  return fmt::format("{} ago", print::duration_text(std::max(age, decltype(age)::zero())));
}

}  // namespace millrace::tools::commands::look
