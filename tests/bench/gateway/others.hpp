// Round trips of other systems on this host, with messages of `size` bytes both ways. Nothing if
// they are not built in, or do not work here.
#pragma once

#include <cstddef>
#include <optional>

#include "tests/bench/gateway/series.hpp"

namespace millrace::bench {

std::optional<Series> measure_grpc(std::size_t calls, std::size_t size);
std::optional<Series> measure_lcm(std::size_t calls, std::size_t size);

}  // namespace millrace::bench
