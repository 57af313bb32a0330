// Rows for the tests of the archive.
#pragma once

#include "services/archiver/row.hpp"

namespace millrace::services::archiver {

/// 2026-03-01T07:00:00Z.
inline constexpr fabric::Time morning{std::chrono::sys_days{std::chrono::year{2026} / 3 / 1} +
                                      std::chrono::hours(7)};

inline Put put(std::uint64_t number, fabric::Time at = morning) {
  return {.call = {.epoch = 0x5f, .number = number},
          .key = {.machine = "cnc", .channel = 1},
          .at = at,
          .state = 7,
          .text = "PUT part=WELLE7 d=\"12.345 mm\"",
          .fields = {{"part", "WELLE7"}, {"d", "12.345 mm"}},
          .replayed = false};
}

inline EventRow event(std::uint64_t number, fabric::Time at = morning) {
  return {.event = {.key = {.machine = "cnc", .channel = 1},
                    .call = {.epoch = 0x5f, .number = number},
                    .attempt = 1,
                    .kind = fabric::EventKind::replied,
                    .at = at,
                    .instance = {},
                    .uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47",
                    .text = "Ma\xDF",
                    .state = 1,
                    .detail = "from test",
                    .replayed = false},
          .with_text = true};
}

inline fabric::ChannelStatus channel(fabric::ChannelState state, fabric::Time since = morning) {
  fabric::ChannelStatus status;
  status.key = {.machine = "cnc", .channel = 2};
  status.state = state;
  status.since = since;
  status.reason = "no service has this UUID";
  return status;
}

}  // namespace millrace::services::archiver
