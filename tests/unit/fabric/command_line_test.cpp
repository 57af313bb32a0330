#include "fabric/profile/command_line.hpp"

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"

namespace millrace::fabric {
namespace {

using testing::HasSubstr;

std::string data(const std::string& name) {
  return tests::test_data("config") / name;
}

dds::ParticipantOptions parse(std::vector<std::string> arguments,
                              const std::string& of_host = "/no/such/file") {
  CLI::App app;
  const profile::FabricFlags sut(app, {.name = "test"}, of_host);
  std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them in reverse
  app.parse(arguments);
  return sut.options();
}

TEST(FabricFlags, StayOnThisHostByDefault) {
  ::unsetenv("MILLRACE_FABRIC_CONFIG");
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

TEST(FabricFlags, OverrideTheFile) {
  const auto options = parse({"--domain", "9", "--fabric", "test-hall", "--fabric-config",
                              data("good/two_networks.fabric.textproto")});
  EXPECT_EQ(options.domain, 9);
  EXPECT_EQ(options.fabric, "test-hall");
  EXPECT_EQ(options.lease, std::chrono::seconds(2));
}

/// An environment variable for the duration of a test.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (value != nullptr) {
      ::setenv(name, value, 1);
    } else {
      ::unsetenv(name);
    }
  }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

TEST(FabricFlags, UseTheFileOfTheHostWhereNoneIsNamed) {
  const Variable unset("MILLRACE_FABRIC_CONFIG", nullptr);
  EXPECT_EQ(parse({}, data("good/two_networks.fabric.textproto")).domain, 7);
  EXPECT_EQ(parse({"--domain", "9"}, data("good/two_networks.fabric.textproto")).domain, 9);
  const tests::TemporaryFolder bad;
  tests::write_bad_configurations("fabric", bad.path());
  EXPECT_THROW(parse({}, bad.path() / "wrong_values.fabric.textproto"), base::program::UsageError);
}

TEST(FabricFlags, UseNoFileWhereTheEnvironmentNamesAnEmptyOne) {
  const Variable none("MILLRACE_FABRIC_CONFIG", "");
  EXPECT_EQ(parse({}, data("good/two_networks.fabric.textproto")).domain, 0);
}

TEST(FabricFlags, ReadTheEnvironment) {
  const Variable file("MILLRACE_FABRIC_CONFIG", data("good/two_networks.fabric.textproto").c_str());
  const Variable fabric("MILLRACE_FABRIC", "hall-2");
  EXPECT_EQ(parse({}).domain, 7);
  const Variable domain("MILLRACE_DOMAIN", "11");
  EXPECT_EQ(parse({}).domain, 11);
  EXPECT_EQ(parse({}).fabric, "hall-2");
  EXPECT_EQ(parse({"--domain", "9", "--fabric", "mine"}).domain, 9);
  EXPECT_EQ(parse({"--domain", "9", "--fabric", "mine"}).fabric, "mine");
}

TEST(FabricFlags, RefuseABrokenFileAndAFabricThatWouldBeAPattern) {
  const tests::TemporaryFolder bad;
  tests::write_bad_configurations("fabric", bad.path());
  EXPECT_THROW(parse({"--fabric-config", bad.path() / "wrong_values.fabric.textproto"}),
               base::program::UsageError);
  EXPECT_THROW(parse({"--fabric", "*"}), base::program::UsageError);
}

}  // namespace
}  // namespace millrace::fabric
