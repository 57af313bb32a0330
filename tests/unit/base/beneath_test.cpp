#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/posix/files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::posix {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Beneath : public testing::Test {
 protected:
  Beneath() {
    fs::create_directories(inside / "sub");
    fs::create_directories(outside);
    std::ofstream(outside / "secret") << "secret";
  }

  static constexpr int append = O_WRONLY | O_APPEND | O_CREAT;
  std::string refusal(const std::string& name, int flags = append) {
    const auto sut = open_beneath(inside, name, flags);
    return sut ? "opened" : sut.error();
  }

  tests::TemporaryFolder folder;
  fs::path inside = folder.path() / "inside";
  fs::path outside = folder.path() / "outside";
};

TEST_F(Beneath, FilesAreMadeAndRead) {
  const auto made = open_beneath(inside, "sub/message.txt", append);
  ASSERT_TRUE(made) << made.error();
  ASSERT_EQ(::write(made->get(), "one", 3), 3);
  EXPECT_EQ(fs::file_size(inside / "sub/message.txt"), 3U);
  EXPECT_TRUE(open_beneath(inside, "sub/message.txt", O_RDONLY));
}

TEST_F(Beneath, NoNameLeavesTheFolder) {
  const std::vector<std::string> names{(outside / "secret").string(),
                                       "../outside/secret",
                                       "sub/../../outside/secret",
                                       "",
                                       "sub/",
                                       ".."};
  for (const std::string& name : names) {
    EXPECT_THAT(refusal(name, O_RDONLY), HasSubstr("outside")) << name;
  }
}

TEST_F(Beneath, NamesThatBeginWithADotAreRefused) {
  EXPECT_THAT(refusal(".bashrc"), HasSubstr("begin with a dot"));
  EXPECT_THAT(refusal(".ssh/authorized_keys"), HasSubstr("begin with a dot"));
  EXPECT_FALSE(fs::exists(inside / ".bashrc"));
}

TEST_F(Beneath, NoLinkIsFollowed) {
  fs::create_symlink(outside / "secret", inside / "file");
  fs::create_directory_symlink(outside, inside / "way");
  fs::create_hard_link(outside / "secret", inside / "twin");
  for (const char* name : {"file", "way/secret"}) {
    EXPECT_THAT(refusal(name), HasSubstr("a symbolic link")) << name;
    EXPECT_THAT(refusal(name, O_RDONLY), HasSubstr("a symbolic link")) << name;
  }
  EXPECT_THAT(refusal("twin"), HasSubstr("hard link"));
}

TEST_F(Beneath, OnlyPlainFilesAreOpenedWithoutWaiting) {
  ASSERT_EQ(::mkfifo((inside / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal("pipe"),
              testing::AnyOf(HasSubstr("not a regular file"), HasSubstr("No such device")));
  EXPECT_THAT(refusal("pipe", O_RDONLY), HasSubstr("not a regular file"));
  EXPECT_THAT(refusal("sub", O_RDONLY), HasSubstr("not a regular file"));
}

TEST_F(Beneath, ANameIsFoundInAnyCase) {
  std::ofstream(inside / "sub/Drill.cyc") << "text";
  EXPECT_EQ(find_ignoring_case(inside, "sub/Drill.cyc"), "sub/Drill.cyc");
  EXPECT_EQ(find_ignoring_case(inside, "SUB/DRILL.CYC"), "sub/Drill.cyc");
  EXPECT_EQ(find_ignoring_case(inside, "sub/mill.cyc"), std::nullopt);
  EXPECT_EQ(find_ignoring_case(inside, "../OUTSIDE/secret"), std::nullopt);
  EXPECT_EQ(find_ignoring_case(inside, (outside / "secret").string()), std::nullopt);
  EXPECT_EQ(find_ignoring_case(inside, ".SSH/key"), std::nullopt);
}

}  // namespace
}  // namespace millrace::base::posix
