// The epoch of a new journal.
#pragma once

#include <cstdint>

namespace millrace::gateway::journal {

/// 48 random bits, never 0: no two journals share their call ids.
std::uint64_t draw_epoch();

}  // namespace millrace::gateway::journal
