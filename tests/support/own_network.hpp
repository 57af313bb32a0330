// A network for one test program, in which multicast goes over the loopback interface: nothing
// leaves it, and programs with fixed ports do not meet those of other tests.
//
//   const std::string obstacle = enter_own_network();   // first thing, before there are threads
#pragma once

#include <string>

namespace millrace::tests {

/// Moves this process, and all that it starts later, into it. Returns why that is impossible, or an
/// empty text.
std::string enter_own_network();

}  // namespace millrace::tests
