#include "base/program/barrier.hpp"

#include <stdexcept>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/log.hpp"

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
      said.push_back(line);
      return true;
    });
  }
  ~BarrierTest() override { report_contained_to(nullptr); }

  std::vector<std::string> said;
};

TEST_F(BarrierTest, RunsWorkThatThrowsNothing) {
  bool done = false;
  contain("a test", [&] { done = true; });
  EXPECT_TRUE(done);
  EXPECT_THAT(said, IsEmpty());
}

TEST_F(BarrierTest, StopsAnExceptionAndReportsWhere) {
  contain("the first test", [] { throw std::runtime_error("no reason"); });
  EXPECT_THAT(said, ElementsAre(AllOf(HasSubstr("the first test"), HasSubstr("no reason"))));
}

TEST_F(BarrierTest, StopsWhatIsNoException) {
  contain("the second test", [] { throw 42; });
  EXPECT_THAT(said, ElementsAre(HasSubstr("not a std::exception")));
}

TEST_F(BarrierTest, LimitsRepeatedLogLines) {
  for (int i = 0; i < 1000; ++i) {
    contain("the third test", [] { throw std::runtime_error("again"); });
  }
  // The 1st, 2nd, 4th … 512th message.
  ASSERT_EQ(said.size(), 10U);
  EXPECT_THAT(said.back(), HasSubstr("(512 so far)"));
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
