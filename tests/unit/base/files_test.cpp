#include "base/posix/files.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/program/barrier.hpp"
#include "base/program/log.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::posix {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;
namespace fs = std::filesystem;

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

TEST_F(DurableFile, IsNotWrittenThroughALinkAtItsTemporaryName) {
  const fs::path other = folder.path() / "other";
  fs::create_symlink(other, file.string() + ".part");
  ASSERT_TRUE(write_durably(file, "text"));
  EXPECT_FALSE(fs::exists(other));
  EXPECT_EQ(content(file), "text");
  EXPECT_FALSE(fs::is_symlink(file));
}

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
  for (const tests::PowerCut& cut : disk.power_cuts()) {
    const auto left = cut.files.find("file");
    ASSERT_NE(left, cut.files.end()) << cut.where;
    EXPECT_TRUE(left->second == "new" || (cut.promised == 0 && left->second == "old")) << cut.where;
  }
}

TEST(FolderLock, IsHeldOnceAndReleasedWithItsDescriptor) {
  const tests::TemporaryFolder folder;
  Fd sut = lock_folder(folder.path(), "x.lock", "taken");
  EXPECT_THAT([&] { lock_folder(folder.path(), "x.lock", "another one writes here"); },
              Throws<std::runtime_error>(
                  Property(&std::exception::what, EndsWith(": another one writes here"))));
  EXPECT_TRUE(lock_folder(folder.path(), "y.lock", "taken"));
  sut.close();
  EXPECT_TRUE(lock_folder(folder.path(), "x.lock", "taken"));
}

TEST(FolderLock, NeedsAFolder) {
  EXPECT_THROW(lock_folder("/no/such/folder", "x.lock", "taken"), std::runtime_error);
}

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

namespace millrace::base::program {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class BarrierTest : public testing::Test {
 protected:
  BarrierTest() {
    report_contained_to([this](const std::string& line) {
      reports.push_back(line);
      return true;
    });
  }
  ~BarrierTest() override { report_contained_to(nullptr); }

  std::vector<std::string> reports;
};

TEST_F(BarrierTest, RunsWorkThatThrowsNothing) {
  bool done = false;
  contain("a test", [&] { done = true; });
  EXPECT_TRUE(done);
  EXPECT_THAT(reports, IsEmpty());
}

TEST_F(BarrierTest, StopsAnExceptionAndReportsWhere) {
  contain("the first test", [] { throw std::runtime_error("no reason"); });
  EXPECT_THAT(reports, ElementsAre(AllOf(HasSubstr("the first test"), HasSubstr("no reason"))));
}

TEST_F(BarrierTest, StopsWhatIsNoException) {
  contain("the second test", [] { throw 42; });
  EXPECT_THAT(reports, ElementsAre(HasSubstr("not a std::exception")));
}

TEST_F(BarrierTest, LimitsRepeatedLogLines) {
  for (int i = 0; i < 1000; ++i) {
    contain("the third test", [] { throw std::runtime_error("again"); });
  }
  // The 1st, 2nd, 4th … 512th message.
  ASSERT_EQ(reports.size(), 10U);
  EXPECT_THAT(reports.back(), HasSubstr("(512 so far)"));
}

TEST(Barrier, WritesToTheLogOfTheProgram) {
  testing::internal::CaptureStderr();
  const Log log = make_log("sut");
  contain("the fourth test", [] { throw std::runtime_error("no reason"); });
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              AllOf(HasSubstr("Z sut error the fourth test failed"), HasSubstr("no reason")));
}

TEST(Barrier, WritesToStandardErrorOnceTheLogIsGone) {
  testing::internal::CaptureStderr();
  static_cast<void>(make_log("sut"));
  contain("the fifth test", [] { throw std::runtime_error("no reason"); });
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("the fifth test failed"));
}

boost::asio::awaitable<void> fail_later() {
  co_await boost::asio::post(boost::asio::use_awaitable);
  throw std::runtime_error("in a coroutine");
}

TEST(RethrowFromLoop, PropagatesTheExceptionOfACoroutine) {
  boost::asio::io_context io;
  boost::asio::co_spawn(io, fail_later(), rethrow_from_loop);
  try {
    io.run();
    FAIL() << "the exception is swallowed";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "in a coroutine");
  }
}

}  // namespace
}  // namespace millrace::base::program
