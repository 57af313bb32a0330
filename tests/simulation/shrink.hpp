// Reduces a failing simulation: fewer programs, fewer kinds of faults, for a shorter time.
//
//   const Limits limits = shrink(17, options, World(17, options).run());
#pragma once

#include "tests/simulation/world.hpp"

namespace millrace::tests::simulation {

/// Removes one thing after the other as long as the same promise is broken. `failed` is the outcome
/// with `options`.
Limits shrink(std::uint64_t seed, Options options, const Outcome& failed);

}  // namespace millrace::tests::simulation
