#include "tools/caller/caller.hpp"

#include <atomic>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/log.hpp"
#include "services/sdk/service.hpp"
#include "tests/support/await.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/run_until.hpp"
#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::caller {
namespace {

using namespace std::chrono_literals;
using services::sdk::Call;
using services::sdk::Handler;
using services::sdk::Response;
using services::sdk::Service;
using testing::HasSubstr;
using tests::run_until;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

struct Listener : CallerListener {
  void on_ended(const Ended& end) override { ended.push_back(end); }
  std::vector<Ended> ended;
};

class CallerTest : public testing::Test {
 protected:
  Order order(const std::string& text) {
    return {.key = key, .uuid = uuid, .text = text, .patience = 20s, .replayed = true};
  }

  tests::Domain domain;
  boost::asio::io_context io;
  Listener listener;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  const base::program::Log log = base::program::no_log();
  const fabric::ChannelKey key{unique_machine("call"), 1};
};

TEST_F(CallerTest, CallsAServiceThatStartsLater) {
  Caller sut(participant, io.get_executor(), listener);
  const auto call = sut.call(order("2"));
  ASSERT_TRUE(call.has_value());
  std::atomic<bool> marked = false;
  Service service({.uuid = uuid, .name = "echo", .domain = domain.number()},
                  Handler([&](const Call& given) {
                    marked = given.replayed();
                    return Response{.text = "answer to " + given.text()};
                  }),
                  log);
  ASSERT_TRUE(run_until(io, [&] { return !listener.ended.empty(); }));
  EXPECT_EQ(listener.ended[0].call, *call);
  ASSERT_TRUE(listener.ended[0].reply.has_value()) << listener.ended[0].reason;
  EXPECT_EQ(listener.ended[0].reply->text, "answer to 2");
  EXPECT_TRUE(listener.ended[0].reply->replayed);
  EXPECT_TRUE(marked);
  // The channel is free for the next call.
  ASSERT_TRUE(sut.call(order("3")).has_value());
  ASSERT_TRUE(run_until(io, [&] { return listener.ended.size() == 2; }));
  EXPECT_EQ(listener.ended[1].reply->text, "answer to 3");
}

TEST_F(CallerTest, CancelsARunningHandlerWhenItIsGone) {
  std::atomic<bool> started = false;
  std::atomic<bool> cancelled = false;
  Service service({.uuid = uuid, .name = "slow", .domain = domain.number()},
                  Handler([&](const Call& given) {
                    started = true;
                    tests::await("the cancellation", [&] { return given.cancelled(); });
                    cancelled = true;
                    return Response{.text = "too late"};
                  }),
                  log);
  {
    Caller sut(participant, io.get_executor(), listener);
    ASSERT_TRUE(sut.call(order("2")).has_value());
    ASSERT_TRUE(run_until(io, [&] { return started.load(); }));
  }
  EXPECT_TRUE(run_until(io, [&] { return cancelled.load(); }));
  EXPECT_TRUE(listener.ended.empty());
}

TEST_F(CallerTest, EndsACallAfterItsTimeout) {
  Caller sut(participant, io.get_executor(), listener);
  Order hasty = order("2");
  hasty.patience = 50ms;
  ASSERT_TRUE(sut.call(hasty).has_value());
  ASSERT_TRUE(run_until(io, [&] { return !listener.ended.empty(); }));
  EXPECT_FALSE(listener.ended[0].reply.has_value());
  EXPECT_THAT(listener.ended[0].reason, HasSubstr("no response within 0.05 s"));
}

TEST(CallerChannel, IsRefusedWhileAGatewayServesItsMachine) {
  bus::FabricModel live;
  live.add({.sample = fabric::ChannelStatus{.key = {"cnc", 1}}});
  EXPECT_THAT(reason_taken(live, {"cnc", 7}).value_or(""),
              HasSubstr("a gateway serves machine 'cnc'"));
  EXPECT_EQ(reason_taken(live, {"call.1", 1}), std::nullopt);
}

TEST(CallerChannel, NamesAreUnique) {
  EXPECT_NE(unique_machine("call"), unique_machine("call"));
  EXPECT_THAT(unique_machine("call"), testing::StartsWith("call."));
}

}  // namespace
}  // namespace millrace::tools::caller
