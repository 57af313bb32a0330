// Carries out what the call control decides.
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

void Core::carry_out(control::ChannelActions actions) {
  for (const control::ChannelAction& one : actions) {
    std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
  }
  control_.recycle(std::move(actions));
}

void Core::carry_out(const fabric::ChannelKey& key, const Read& action) {
  queues_.has(key) ? queues_.read(key, action.look) : machines_.read(key, action.look);
}

void Core::carry_out(const fabric::ChannelKey& key, const Write& action) {
  if (queues_.has(key)) {
    write_queue(key, action);
  } else {
    machines_.write(key, action.variable, action.value);
  }
}

void Core::carry_out(const fabric::ChannelKey&, const Record& action) {
  host_.append(action.entry, action.ticket);
}

void Core::carry_out(const fabric::ChannelKey&, const Publish& action) {
  fabric_.publish(action.request);
}

void Core::carry_out(const fabric::ChannelKey& key, const Withdraw& action) {
  fabric_.dispose(fabric::RequestKey{key, action.epoch, action.instance});
}

void Core::carry_out(const fabric::ChannelKey&, const Tell& action) {
  fabric_.publish(action.event);
}

void Core::carry_out(const fabric::ChannelKey&, const Show& action) {
  fabric_.publish(action.status);
}

void Core::carry_out(const fabric::ChannelKey& key, const Hide&) {
  fabric_.dispose(key);
  queues_.has(key) ? queues_.on_over(key) : machines_.on_over(key);
}

void Core::carry_out(const fabric::ChannelKey& key, const Say& action) {
  host_.say(action.level, fmt::format("{}: {}", key.to_string(), action.text));
}

void Core::carry_out(const fabric::ChannelKey& key, const WriteProblem& action) {
  host_.notice(
      {.kind = "write", .subject = key.to_string()},
      action.text.empty() ? "" : fmt::format("{}: {}", key.to_string(), action.text),
      "the NC program waits; check whether the controller runs, and whether a PLC or another "
      "ADS client writes V.G.SERVICE of this channel; the gateway repeats the write at least "
      "once a minute");
}

}  // namespace millrace::gateway::core
