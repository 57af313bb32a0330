#include "tests/support/process.hpp"

#include <csignal>
#include <memory>
#include <set>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include "base/posix/system.hpp"
#include "tests/support/domain.hpp"

namespace millrace::tests {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

Process shell(const std::string& script) {
  return Process({"/bin/sh", "-c", script});
}

TEST(Process, ReturnsTheGroupsOfTheLineItWaitedFor) {
  Process sut = shell("echo first; echo ready: port 4711; read never < /dev/zero");
  EXPECT_EQ(sut.await("^ready: port (\\d+)$").at(1), "4711");
  EXPECT_TRUE(sut.running());
}

TEST(Process, KeepsBothStreamsApartAndReturnsTheExitCode) {
  Process sut = shell("echo good; echo bad >&2; exit 3");
  EXPECT_EQ(sut.wait(), 3);
  EXPECT_EQ(sut.output(), "good\n");
  EXPECT_EQ(sut.error_output(), "bad\n");
}

TEST(Process, ReturnsTheSignalThatKilledIt) {
  Process sut = shell("kill -KILL $$");
  EXPECT_EQ(sut.wait(), 128 + SIGKILL);
}

TEST(Process, EndsOnTerminate) {
  Process sut = shell("trap 'echo bye; exit 0' TERM; echo up; while :; do :; done");
  sut.await("^up$");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(sut.output(), HasSubstr("bye"));
}

TEST(Process, ShowsAllOutputWhenTheProcessEndsBeforeTheLine) {
  Process sut = shell("echo something else");
  EXPECT_THAT([&] { sut.await("^ready"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("something else")));
}

// As Cyclone opens its sockets.
TEST(Process, InheritsNoPortOfTheTest) {
  const base::posix::Fd socket(::socket(AF_INET, SOCK_DGRAM, 0));
  ASSERT_TRUE(socket);
  Process sut = shell("readlink /proc/self/fd/* || true");
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(sut.output(), Not(HasSubstr("socket:")));
}

TEST(Process, RefusesAMissingProgram) {
  EXPECT_THROW(Process({"/no/such/program"}), std::system_error);
}

TEST(Domain, GivesEachHolderItsOwn) {
  std::vector<std::unique_ptr<Domain>> sut;
  std::set<std::uint32_t> numbers;
  for (int i = 0; i < 5; ++i) {
    sut.push_back(std::make_unique<Domain>());
    numbers.insert(sut.back()->number());
  }
  EXPECT_EQ(numbers.size(), sut.size());
  EXPECT_FALSE(numbers.contains(0));
}

}  // namespace
}  // namespace millrace::tests
