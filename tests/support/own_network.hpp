// A network of a test program's own, in which multicast goes over the loopback interface: nothing
// leaves it, and programs with fixed ports do not meet those of other tests.
//
//   const std::string obstacle = enter_own_network();   // first thing, before there are threads
#pragma once

#include <string>

namespace millrace::tests {

/// Puts this process, and all that it starts from now on, into it. Why that cannot be, else.
std::string enter_own_network();

}  // namespace millrace::tests
