#include "base/configuration/config_file.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "idl/gateway.pb.h"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::configuration {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

std::filesystem::path data(const std::string& name) {
  return tests::test_data("config") / name;
}

auto read_bad(const std::string& name) {
  const tests::TemporaryFolder folder;
  tests::write_bad_configurations("gateway", folder.path());
  return read_config<config::Gateway>(folder.path() / (name + ".gateway.textproto"));
}

TEST(ConfigFile, FillsTheMessageFromAGoodFile) {
  const auto sut = read_config<config::Gateway>(data("good/one_machine.gateway.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->machine(0).name(), "cnc");
  EXPECT_EQ(sut->machine(0).channel_size(), 2);
}

TEST(ConfigFile, NamesFileLineAndColumnOfAnUnknownField) {
  const auto sut = read_bad("misspelt_field");
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr("misspelt_field.gateway.textproto:3:7: "));
  EXPECT_THAT(sut.error(), HasSubstr("\"hots\""));
}

TEST(ConfigFile, NamesTheExpectedTypeOfAWrongValue) {
  const auto sut = read_bad("wrong_type");
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr("wrong_type.gateway.textproto:1:29: Expected integer"));
}

TEST(ConfigFile, ReportsThatAFileIsMissing) {
  const auto sut = read_config<config::Gateway>(data("no_such_file.textproto"));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(),
              EndsWith("no_such_file.textproto: cannot be read (No such file or directory)"));
}

TEST(ConfigFile, IsARegularFileOfALimitedSize) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe.string(), std::string("/dev/zero"), std::string("/tmp")}) {
    const auto sut = read_config<config::Gateway>(file);
    ASSERT_FALSE(sut);
    EXPECT_EQ(sut.error(), file + ": is not a regular file; name a file");
  }
  const std::filesystem::path large = folder.path() / "large";
  std::ofstream(large) << "#";
  std::filesystem::resize_file(large, (16U << 20U) + 1);
  EXPECT_EQ(read_config<config::Gateway>(large).error(),
            large.string() + ": cannot be read (it has more than 16 MiB)");
}

TEST(ConfigFile, IsNotOneThatAllUsersOfTheHostCanWrite) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "gateway.textproto";
  std::ofstream(file) << "machine { name: 'press' }\n";
  ASSERT_TRUE(read_config<config::Gateway>(file)) << read_config<config::Gateway>(file).error();
  std::filesystem::permissions(file, std::filesystem::perms::others_write,
                               std::filesystem::perm_options::add);
  EXPECT_EQ(
      read_config<config::Gateway>(file).error(),
      file.string() + ": all users of this host can write it; `chmod go-w " + file.string() +
          "`, and replace it if others may have changed it; where a mount ignores chmod (Docker "
          "Desktop for Windows), copy it into the image or a named volume");
}

TEST(ConfigFile, LeavesTheMessageEmptyAfterAMistake) {
  config::Gateway message;
  ASSERT_FALSE(parse_config("machine { name: \"a\" } oops: 1", "x", message));
  EXPECT_EQ(message.machine_size(), 0);
}

void read(const std::string& name, config::Gateway& message, ConfigPlaces& places) {
  const auto file = data("good/" + name + ".gateway.textproto");
  ASSERT_TRUE(parse_config(read_text(file).value(), file.string(), message, &places));
}

TEST(ConfigFile, HasThePlaceOfEachField) {
  config::Gateway message;
  ConfigPlaces sut;
  read("one_machine", message, sut);
  EXPECT_THAT(sut.at(message, {{"machine", 0}}), EndsWith("one_machine.gateway.textproto:2:1"));
}

TEST(ConfigPlaces, FindsFieldsInsideOthers) {
  config::Gateway message;
  ConfigPlaces sut;
  read("everything", message, sut);
  EXPECT_THAT(sut.at(message, {{"machine", 1}, {"host"}}),
              EndsWith("everything.gateway.textproto:14:27"));
  // For a list in brackets only its beginning is known.
  EXPECT_THAT(sut.at(message, {{"machine", 0}, {"channel", 1}}),
              EndsWith("everything.gateway.textproto:9:3"));
}

TEST(ConfigPlaces, NamesTheNextOuterFieldOfOneThatWasNotWritten) {
  config::Gateway message;
  ConfigPlaces sut;
  read("everything", message, sut);
  EXPECT_THAT(sut.at(message, {{"machine", 1}, {"port"}}),
              EndsWith("everything.gateway.textproto:14:1"));
}

}  // namespace
}  // namespace millrace::base::configuration
