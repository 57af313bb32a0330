#include "fabric/profile/command_line.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::HasSubstr;

std::string data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

dds::ParticipantOptions parse(std::vector<std::string> arguments) {
  CLI::App app;
  const profile::FabricFlags sut(app, {.name = "test"});
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
  app.parse(arguments);
  return sut.options();
}

TEST(FabricFlags, StayOnThisHostByDefault) {
  const dds::ParticipantOptions options = parse({});
  EXPECT_EQ(options.fabric, "millrace");
  EXPECT_EQ(options.domain, 0);
  EXPECT_EQ(options.configuration, "");
}

TEST(FabricFlags, ReadTheFile) {
  const auto options = parse({"--fabric-config", data("good/two_networks.fabric.textproto")});
  EXPECT_EQ(options.domain, 7);
  EXPECT_EQ(options.name, "test");
  EXPECT_THAT(options.configuration, HasSubstr("eth1"));
}

TEST(FabricFlags, WinOverTheFile) {
  const auto options = parse({"--domain", "9", "--fabric", "test-hall", "--fabric-config",
                              data("good/two_networks.fabric.textproto")});
  EXPECT_EQ(options.domain, 9);
  EXPECT_EQ(options.fabric, "test-hall");
  EXPECT_EQ(options.lease, std::chrono::seconds(2));
}

TEST(FabricFlags, RefuseABrokenFileAndAFabricThatWouldBeAPattern) {
  EXPECT_THROW(parse({"--fabric-config", data("bad/wrong_values.fabric.textproto")}),
               base::program::UsageError);
  EXPECT_THROW(parse({"--fabric", "*"}), base::program::UsageError);
}

}  // namespace
}  // namespace millrace::fabric
