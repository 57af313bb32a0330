// A journal that cannot be written any more.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/failures/line.hpp"

namespace millrace::tests::failures {
namespace {

/// The size to which a process may write files; a write beyond it fails, as on a full disk.
void limit_files(const Process& process, rlim_t bytes) {
  rlimit limit{};
  ASSERT_EQ(::prlimit(process.pid(), RLIMIT_FSIZE, nullptr, &limit), 0);
  limit.rlim_cur = bytes;
  ASSERT_EQ(::prlimit(process.pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
}

TEST(AJournalOnAFullDisk, StopsNewCallsAndLosesNone) {
  Line sut({.point = Point::running});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  ASSERT_NO_FATAL_FAILURE(limit_files(sut.gateway(), 0));
  sut.gateway().await_error(
      "calls.journal cannot be written: .*; the gateway accepts no new call until the journal is "
      "writable");
  ASSERT_NO_FATAL_FAILURE(limit_files(sut.gateway(), RLIM_INFINITY));
  sut.gateway().await_error("calls.journal is writable again");
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

TEST(AJournalOnAFullDisk, IsWholeForTheGatewayThatComesAfter) {
  Line sut({.point = Point::running});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  ASSERT_NO_FATAL_FAILURE(limit_files(sut.gateway(), 0));
  sut.gateway().await_error("the gateway accepts no new call until the journal is writable");
  sut.kill(Victim::gateway);
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

TEST(AGatewayWithoutAJournal, RepeatsACallThatRanWhenItWasKilled) {
  Line sut({.point = Point::running, .journal = false});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.kill(Victim::gateway);
  sut.expect_every_answer();
}

TEST(AGatewayWithoutAJournal, DispatchesACallAgainWhoseAnswerItHadBegunToWrite) {
  Line sut({.point = Point::before_clear, .journal = false});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.kill(Victim::gateway);
  sut.expect_every_answer();
}

TEST(AGatewayWithoutAJournal, LeavesAProgramWaitingWhoseRequestItHadCleared) {
  Line sut({.point = Point::before_release, .journal = false});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.kill(Victim::gateway);
  sut.gateway().await_error("link up");
  EXPECT_FALSE(sut.finished());
  // RESPONSE is written; RESPONSE_STATE, which releases the program, is missing.
  sut.write_variable("V.G.SERVICE.RESPONSE_STATE", "1");
  sut.expect_every_answer();
}

}  // namespace
}  // namespace millrace::tests::failures
