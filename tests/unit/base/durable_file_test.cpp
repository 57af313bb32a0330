#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/posix/files.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::posix {
namespace {

using testing::HasSubstr;

class DurableFile : public testing::Test {
 protected:
  static std::string content(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder.path()), {});
  }

  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "file";
};

TEST_F(DurableFile, HoldsWhatWasWrittenLast) {
  ASSERT_TRUE(write_durably(file, "a longer first one"));
  ASSERT_TRUE(write_durably(file, std::string("a\0b", 3)));
  EXPECT_EQ(content(file), std::string("a\0b", 3));
  EXPECT_EQ(files(), 1);
}

TEST_F(DurableFile, StaysAsItWasWhenWritingFails) {
  ASSERT_TRUE(write_durably(file, "old"));
  // A folder in the place of the temporary file, as an example of any failure.
  std::filesystem::create_directory(file.string() + ".part");
  EXPECT_THAT(write_durably(file, "new").error(), HasSubstr("cannot create " + file.string()));
  EXPECT_EQ(content(file), "old");
}

TEST_F(DurableFile, InAMissingFolderIsAnError) {
  EXPECT_THAT(write_durably(folder.path() / "no" / "file", "x").error(),
              HasSubstr("No such file or directory"));
}

TEST_F(DurableFile, IsGoneOnceRemovedAndMayBeGoneBefore) {
  ASSERT_TRUE(write_durably(file, "x"));
  EXPECT_TRUE(remove_durably(file));
  EXPECT_TRUE(remove_durably(file));
  EXPECT_EQ(files(), 0);
}

TEST_F(DurableFile, MovesIntoAnotherFolder) {
  ASSERT_TRUE(write_durably(file, "x"));
  const auto other = folder.path() / "other";
  std::filesystem::create_directory(other);
  ASSERT_TRUE(rename_durably(file, other / "file"));
  EXPECT_EQ(content(other / "file"), "x");
  EXPECT_FALSE(rename_durably(file, other / "file"));
}

TEST_F(DurableFile, IsTheOldOrTheNewOneAfterAPowerCutAndTheNewOneOnceItIsWritten) {
  ASSERT_TRUE(write_durably(file, "old"));
  tests::PowerCutDisk disk(folder.path());
  ASSERT_TRUE(write_durably(file, "new"));
  disk.promise(1);
  ASSERT_TRUE(remove_durably(file));
  disk.promise(2);
  for (const tests::PowerCut& cut : disk.power_cuts()) {
    const auto left = cut.files.find("file");
    const bool there = left != cut.files.end();
    if (cut.promised == 0) {
      EXPECT_TRUE(there && (left->second == "old" || left->second == "new")) << cut.where;
    } else if (cut.promised == 1) {
      EXPECT_TRUE(!there || left->second == "new") << cut.where;
    } else {
      EXPECT_FALSE(there) << cut.where;
    }
  }
}

}  // namespace
}  // namespace millrace::base::posix
