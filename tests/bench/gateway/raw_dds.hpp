// Bare Cyclone DDS request and reply in the same types: the floor under a call.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tests/bench/gateway/series.hpp"

namespace millrace::bench {

struct RawResult {
  Series round_trips;
  double calls_per_second = 0;
};

/// `in_flight` calls at a time, each on a key of its own, to `processes` echo processes; `calls` in
/// all. The next call of a key is written in the listener that got its reply.
RawResult measure_raw(std::uint32_t domain, std::size_t calls, std::size_t in_flight,
                      std::uint32_t processes);

}  // namespace millrace::bench
