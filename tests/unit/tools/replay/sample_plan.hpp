// Plans and recorded entries for the tests of the replayer.
#pragma once

#include <chrono>
#include <string>

#include "tools/recording/entry.hpp"
#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

inline const std::string root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// A call of channel cnc/`channel` at `at` that was answered `took` later.
inline PlannedCall planned(std::uint16_t channel, std::chrono::milliseconds at,
                           std::chrono::milliseconds took, const std::string& text = "2",
                           const std::string& answer = "1.414214") {
  return {.recorded = {7, static_cast<std::uint64_t>(at.count()) + 1},
          .channel = {"cnc", channel},
          .uuid = root,
          .text = text,
          .state = 1,
          .at = at,
          .answer = TimedAnswer{{answer, 1, std::nullopt}, took, took / 2}};
}

/// 2026-03-01T08:00:00Z and then.
inline fabric::Time recorded_at(std::chrono::milliseconds offset) {
  return fabric::Time(std::chrono::seconds(1772352000) + offset);
}

inline fabric::Request request_entry(std::uint64_t number, std::uint16_t channel = 1) {
  return {.key = {"cnc", channel}, .call = {7, number}, .uuid = root, .text = "2", .state = 1};
}

inline fabric::Reply reply_entry(std::uint64_t number, const std::string& text = "1.414214",
                                 std::uint16_t channel = 1) {
  return {.key = {"cnc", channel}, .call = {7, number}, .text = text, .state = 1};
}

inline recording::Entry entry(std::chrono::milliseconds at, recording::Sample sample) {
  return {.at = recorded_at(at), .uuid = root, .sample = std::move(sample)};
}

}  // namespace millrace::tools::replay
