#include "fabric/dds/configuration.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace millrace::fabric {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

const std::string loopback = "name=\"lo\"";

TEST(CycloneConfiguration, StaysOnLoopback) {
  EXPECT_THAT(dds::cyclone_configuration("", ""), HasSubstr(loopback));
  EXPECT_THAT(dds::cyclone_configuration("", "<Tracing><Verbosity>fine</Verbosity></Tracing>"),
              HasSubstr(loopback));
}

TEST(CycloneConfiguration, PutsTheUsersSettingsLastSoThatTheyWin) {
  EXPECT_THAT(dds::cyclone_configuration("<A/>", "<B/>"), EndsWith(",<A/>,<B/>"));
}

TEST(CycloneConfiguration, LeavesTheInterfaceToWhoeverNamesOne) {
  const std::string named = R"(<General><NetworkInterfaceAddress>eth1</NetworkInterfaceAddress>)";
  EXPECT_THAT(dds::cyclone_configuration(named, ""), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration("", named), Not(HasSubstr(loopback)));
}

TEST(CycloneConfiguration, LooksForAnInterfaceInFiles) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "dds.xml";
  std::ofstream(file) << R"(<Interfaces><NetworkInterface name="eth1"/></Interfaces>)";
  EXPECT_THAT(dds::cyclone_configuration("", "file://" + file.string()), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration("", "<A/>," + file.string()), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration("", "file:///no/such/file"), HasSubstr(loopback));
}

}  // namespace
}  // namespace millrace::fabric
