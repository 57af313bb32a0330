// What a service call took, as the program saw it. The kernel's rules are in
// service_interface.scenario.
#include "cnc/simulator/service_interface.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::simulator {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

class Timing : public testing::Test {
 protected:
  void program_writes(const char* name, nc::Value value) {
    ASSERT_TRUE(globals_.find(name)->assign(Variable::scalar, value));
  }
  void client_writes(const char* name, std::uint8_t value) {
    ASSERT_TRUE(globals_.find(name)->write(Variable::scalar, ads::Bytes{value, 0, 0, 0}));
  }

  nanoseconds now_{0};
  std::vector<AnsweredCall> calls_;
  Family globals_;
  ServiceInterface sut_{globals_,
                        {},
                        [this] { return now_; },
                        [this](const AnsweredCall& call) { calls_.push_back(call); }};
};

TEST_F(Timing, RunsFromTheRequestToTheFirstResponse) {
  program_writes("V.G.SERVICE.UUID", "a-uuid");
  now_ = milliseconds(10);
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(12);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 5);
  now_ = milliseconds(20);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 6);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].number, 1);
  EXPECT_EQ(calls_[0].uuid, "a-uuid");
  EXPECT_EQ(calls_[0].duration, milliseconds(2));
}

TEST_F(Timing, StartsAgainWithEachRequest) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(5);
  program_writes("V.G.SERVICE.REQUEST_STATE", 2.0);
  now_ = milliseconds(6);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].duration, milliseconds(1));
}

TEST_F(Timing, ForgetsARequestThatWasWithdrawn) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  program_writes("V.G.SERVICE.REQUEST_STATE", 0.0);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  EXPECT_TRUE(calls_.empty());
}

TEST_F(Timing, ForgetsARequestThatWasReset) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  sut_.reset();
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  EXPECT_TRUE(calls_.empty());
}

TEST_F(Timing, GoesOnWhenTheClientWithdrawsTheRequestFirst) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(3);
  client_writes("V.G.SERVICE.REQUEST_STATE", 0);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].duration, milliseconds(3));
}

}  // namespace
}  // namespace millrace::cnc::simulator
