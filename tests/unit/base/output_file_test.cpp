#include "base/posix/output_file.hpp"

#include <filesystem>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace millrace::base::posix {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class AnOutputFile : public testing::Test {
 protected:
  AnOutputFile() { sut.emplace(); }

  static std::string content_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  tests::TemporaryFolder folder;
  fs::path file = folder.path() / "out.csv";
  std::optional<OutputFile> sut;
};

TEST_F(AnOutputFile, HasItsNameOnceItIsWhole) {
  ASSERT_TRUE(sut->open(file));
  sut->stream() << "text";
  EXPECT_FALSE(fs::exists(file));
  ASSERT_TRUE(sut->finish());
  sut.reset();
  EXPECT_EQ(content_of(file), "text");
  EXPECT_FALSE(fs::exists(file.string() + ".part"));
}

TEST_F(AnOutputFile, LeavesThePreviousOneWhereItIsNotFinished) {
  std::ofstream(file) << "old";
  ASSERT_TRUE(sut->open(file));
  sut->stream() << "half of the ne";
  sut.reset();
  EXPECT_EQ(content_of(file), "old");
  EXPECT_FALSE(fs::exists(file.string() + ".part"));
}

TEST_F(AnOutputFile, ReplacesALinkAndDoesNotFollowIt) {
  const fs::path other = folder.path() / "other";
  std::ofstream(other) << "another's";
  fs::create_symlink(other, file);
  fs::create_symlink(other, file.string() + ".part");
  ASSERT_TRUE(sut->open(file));
  sut->stream() << "text";
  ASSERT_TRUE(sut->finish());
  EXPECT_EQ(content_of(other), "another's");
  EXPECT_FALSE(fs::is_symlink(file));
  EXPECT_EQ(content_of(file), "text");
}

TEST_F(AnOutputFile, KeepsThePermissionsOfTheOneThatItReplaces) {
  std::ofstream(file) << "old";
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(sut->open(file));
  ASSERT_TRUE(sut->finish());
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(AnOutputFile, WritesADeviceDirectlyAndReportsThatItIsFull) {
  ASSERT_TRUE(sut->open("/dev/full"));
  sut->stream() << "text";
  EXPECT_THAT(sut->finish().error(),
              HasSubstr("/dev/full cannot be written: No space left on device"));
  EXPECT_TRUE(fs::exists("/dev/full"));
}

TEST_F(AnOutputFile, InAMissingFolderIsAnError) {
  EXPECT_THAT(sut->open(folder.path() / "no" / "out.csv").error(),
              HasSubstr("cannot be written: No such file or directory"));
}

}  // namespace
}  // namespace millrace::base::posix
