// Samples without readers are not formatted, which changes nothing else.
#include <gmock/gmock.h>

#include "tests/unit/gateway/core_calls_test.hpp"

namespace millrace::gateway {
namespace {

using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr Readers no_readers{.events = false, .statuses = false, .min_level = Level::error};

class ReadersTest : public CoreCallsTest {
 protected:
  void start_before(const Readers& readers) {
    start();
    sut->set_readers(readers, now);
    link_up();
    sut->on_instance_ready(instance(1), now);
  }
};

TEST_F(ReadersTest, GetTheEventsStatesAndLinesOfACall) {
  start_before({});
  const auto actions = answered_call(1);
  EXPECT_THAT(all<EmitEvent>(actions), Not(IsEmpty()));
  EXPECT_THAT(all<PublishStatus>(actions), Not(IsEmpty()));
  EXPECT_THAT(all<Log>(actions), Not(IsEmpty()));
}

TEST_F(ReadersTest, ThatAreAbsentGetNothingAndTheCallIsStillAnswered) {
  start_before(no_readers);
  const auto actions = answered_call(1);
  EXPECT_THAT(all<EmitEvent>(actions), IsEmpty());
  EXPECT_THAT(all<PublishStatus>(actions), IsEmpty());
  EXPECT_THAT(all<Log>(actions), IsEmpty());
  EXPECT_THAT(all<Write>(actions), SizeIs(3)) << "RESPONSE, REQUEST_STATE, RESPONSE_STATE";
}

TEST_F(ReadersTest, OfTheLogOnlyGetLinesOfTheirLevel) {
  start_before({.events = false, .statuses = false, .min_level = Level::info});
  EXPECT_THAT(all<Log>(answered_call(1)), IsEmpty()) << "calls are debug";
  sut->set_readers({.events = false, .statuses = false, .min_level = Level::debug}, now);
  EXPECT_THAT(all<Log>(answered_call(2)), Not(IsEmpty()));
}

TEST_F(ReadersTest, ThatBeginGetEveryChannelAsItIs) {
  start_before(no_readers);
  confirm(request(1));
  const auto shown = all<PublishStatus>(sut->set_readers({}, now));
  ASSERT_THAT(shown, SizeIs(2));
  EXPECT_EQ(shown[0].status.state, fabric::ChannelState::running);
  EXPECT_EQ(shown[0].status.uuid, uuid);
  EXPECT_EQ(shown[0].status.instance, instance(1).id);
  EXPECT_EQ(shown[1].status.state, fabric::ChannelState::link_down) << "not read yet";
}

TEST_F(ReadersTest, ThatBeginAgainGetWhatHasChangedAndSinceWhen) {
  start_before({});
  confirm(request(1));
  sut->set_readers(no_readers, now);
  const fabric::Time given = now.wall;
  now.steady += std::chrono::seconds(5);
  now.wall += std::chrono::seconds(5);
  sut->on_time(now);
  const auto shown = all<PublishStatus>(sut->set_readers({}, now));
  ASSERT_THAT(shown, SizeIs(1)) << "DDS has the last status of the other channel";
  EXPECT_EQ(shown[0].status.since, given);
  EXPECT_EQ(shown[0].status.calls, 1U);
}

}  // namespace
}  // namespace millrace::gateway
