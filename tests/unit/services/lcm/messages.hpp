// Messages of LCM processes, for tests.
#pragma once

#include <string>

#include <millrace/presence_t.hpp>
#include <millrace/reply_t.hpp>

#include "fabric/lcm/message.hpp"

namespace millrace::services::lcm::tests {

inline const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
inline constexpr std::int64_t program = 42;

inline presence_t presence(std::int64_t utime, std::vector<call_t> calls = {}) {
  presence_t message{};
  message.running = static_cast<std::int32_t>(calls.size());
  message.calls = std::move(calls);
  message.program = program;
  message.utime = utime;
  message.uuid = uuid;
  message.name = "press";
  message.description = "presses";
  message.version = "1";
  message.concurrency = 1;
  return message;
}

inline reply_t reply(const std::string& call, const std::string& text, std::int64_t state = 1) {
  reply_t message{};
  message.program = program;
  message.call.id = call;
  message.call.attempt = 1;
  message.text = text;
  message.state = state;
  return message;
}

}  // namespace millrace::services::lcm::tests
