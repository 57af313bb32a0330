// An observer cannot slow down or stop calls.
#include <dds/dds.h>
#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

/// Longer than the test, so that the silent side remains alive for DDS.
constexpr std::chrono::milliseconds lease = std::chrono::seconds(60);

class SlowReader : public testing::Test {
 protected:
  template <typename Value>
  void match(const wire::Writer<Value>& writer) {
    boost::asio::io_context context;
    ASSERT_TRUE(tests::run_until(context, [&] { return !writer.matched().empty(); }));
  }

  /// From here on the other side acknowledges nothing.
  void freeze() {
    ASSERT_EQ(dds_domain_set_deafmute(there.handle(), true, true, DDS_INFINITY), DDS_RETCODE_OK);
  }

  static dds::ParticipantOptions with_lease(dds::ParticipantOptions options) {
    options.lease = lease;
    return options;
  }

  TwoProcesses processes;
  dds::Participant here{with_lease(processes.here())};
  dds::Participant there{with_lease(processes.there())};
};

TEST_F(SlowReader, DoesNotHoldUpEvents) {
  wire::Writer<Event> sut(here, "millrace");
  const wire::Reader<Event> recorder(there, "millrace", wire::Keep::all);
  match(sut);
  freeze();
  Event event{.key = {.machine = "cnc", .channel = 1}, .uuid = "weather"};
  event.text.assign(max_text, 'x');
  event.detail.assign(255, 'x');
  for (int i = 0; i < 20'000; ++i) {
    const auto written = sut.write(event);
    ASSERT_TRUE(written) << "event " << i << ": " << written.error();
  }
}

TEST_F(SlowReader, DoesNotHoldUpTheCallsOfOtherChannels) {
  wire::Writer<Request> sut(here, "millrace/weather");
  const wire::Reader<Request> service(there, "millrace/weather", wire::Keep::last);
  match(sut);
  freeze();
  Request request{.key = {.machine = "cnc"}, .uuid = "weather"};
  request.text.assign(max_text, 'x');
  for (std::uint16_t channel = 1; channel <= 1000; ++channel) {
    request.key.channel = channel;
    const auto written = sut.write(request);
    ASSERT_TRUE(written) << "channel " << channel << ": " << written.error();
  }
}

// Without the hold, Cyclone creates and frees the instance for each event.
TEST_F(SlowReader, IsNotWhatHoldsTheOneInstanceOfATopicWithoutAKey) {
  wire::Writer<Event> sut(here, "millrace");
  const auto held = sut.hold({.key = {.machine = "any", .channel = 1}});
  EXPECT_TRUE(held) << held.error();
  EXPECT_FALSE(sut.hold({})) << "an event without a machine is invalid";
}

}  // namespace
}  // namespace millrace::fabric
