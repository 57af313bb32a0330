// A pure listener receives every call, also one that is over before it could arrive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using testing::ElementsAre;

const ChannelKey cnc_1{.machine = "cnc", .channel = 1};

Request request(std::uint64_t number) {
  return {.key = cnc_1, .call = {0x5f, number}, .uuid = "weather"};
}

Reply reply(std::uint64_t number) {
  return {.key = cnc_1, .call = {0x5f, number}, .text = "sun", .state = 1};
}

class ARecordersReader : public testing::Test {
 protected:
  template <typename Value>
  void match(const wire::Writer<Value>& writer) {
    boost::asio::io_context context;
    ASSERT_TRUE(tests::run_until(context, [&] { return !writer.matched().empty(); }));
  }

  /// Waits until `here` has discovered the readers of `there`, one after the other.
  void await_discovery() {
    const wire::Reader<Event> last(there, "millrace", wire::Keep::all);
    const wire::Writer<Event> writer(here, "millrace");
    match(writer);
  }

  /// The numbers of the calls that have arrived, as soon as there are `count`, or at the timeout.
  template <typename Value>
  std::vector<std::uint64_t> numbers(wire::Reader<Value>& reader, std::size_t count) {
    std::vector<std::uint64_t> numbers;
    boost::asio::io_context context;
    tests::run_until(context, [&] {
      for (const wire::Taken<Value>& taken : reader.take()) {
        if (taken.valid) {
          numbers.push_back(taken.value.call.number);
        }
      }
      return numbers.size() >= count;
    });
    return numbers;
  }

  TwoProcesses processes;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
};

TEST_F(ARecordersReader, GetsTheCallsThatAreOverBeforeItFindsTheirWriter) {
  wire::Reader<Request> sut(there, "millrace/*", wire::Keep::all);
  await_discovery();
  wire::Writer<Request> writer(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(writer.write(request(number)));
    writer.withdraw(request(number));
  }
  EXPECT_THAT(numbers(sut, 5), ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(ARecordersReader, GetsTheRepliesThatOthersFollowBeforeItFindsTheirWriter) {
  wire::Reader<Reply> sut(there, "millrace/*", wire::Keep::all);
  await_discovery();
  wire::Writer<Reply> writer(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(writer.write(reply(number)));
  }
  EXPECT_THAT(numbers(sut, 5), ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(ARecordersReader, GetsTheNewestSampleOnlyIfItJoinsLater) {
  wire::Writer<Request> requests(here, "millrace/weather");
  wire::Writer<Reply> replies(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(requests.write(request(number)));
    ASSERT_TRUE(replies.write(reply(number)));
  }
  wire::Reader<Request> late_requests(there, "millrace/*", wire::Keep::all);
  wire::Reader<Reply> late_replies(there, "millrace/*", wire::Keep::all);
  EXPECT_THAT(numbers(late_requests, 1), ElementsAre(5));
  EXPECT_THAT(numbers(late_replies, 1), ElementsAre(5));
}

}  // namespace
}  // namespace millrace::fabric
