#include "tools/doctor/network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tools::doctor {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

TEST(TheNetwork, HasALoopbackInterface) {
  EXPECT_THAT(interfaces_here(), Contains(Field(&Interface::loopback, true)));
}

TEST(TheDomainsOfAHost, AreReadFromItsOpenPorts) {
  // 7400 = 1CE8: domain 0; 7650 = 1DE2: domain 1; 7910 = 1EE6: first program of domain 2; 5353.
  EXPECT_THAT(domains_in("  sl  local_address rem_address   st tx_queue rx_queue\n"
                         "  7: 00000000:1CE8 00000000:0000 07 00000000:00000000\n"
                         "  8: 0100007F:1DE2 00000000:0000 07 00000000:00000000\n"
                         "  9: 00000000:1EE6 00000000:0000 07 00000000:00000000\n"
                         " 10: 00000000:14E9 00000000:0000 07 00000000:00000000\n"),
              ElementsAre(0, 1, 2));
}

TEST(TheDomainsOfAHost, AreNotOtherPorts) {
  // 7405: between the ports of domain 0. 65400 = FF78 would be domain 232.
  EXPECT_THAT(domains_in("  7: 00000000:1CED 0\n  8: 00000000:FF78 0\n"), IsEmpty());
  EXPECT_THAT(domains_in(""), IsEmpty());
  EXPECT_THAT(domains_in("garbage\n7: 0000:\n8: 0:XYZ\n"), IsEmpty());
}

TEST(TheInterfacesOfAHost, OnWhichProgramsListenAreReadFromItsGroups) {
  EXPECT_THAT(listening_interfaces_in("Idx\tDevice    : Count Querier\tGroup    Users Timer\n"
                                      "1\tlo        :     2      V3\n"
                                      "\t\t\t\t0100FFEF     1 0:00000000\t\t0\n"
                                      "\t\t\t\t010000E0     1 0:00000000\t\t0\n"
                                      "4\teth0      :     1      V3\n"
                                      "\t\t\t\t010000E0     1 0:00000000\t\t0\n"),
              ElementsAre("lo"));
  EXPECT_THAT(listening_interfaces_in(""), IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::doctor
