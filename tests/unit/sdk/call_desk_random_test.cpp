// The call desk under a gateway that repeats, reassigns, withdraws and replaces calls at random.
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "services/sdk/call_desk.hpp"

namespace millrace::services::sdk {
namespace {

using fabric::CallId;
using fabric::Request;

constexpr std::size_t concurrency = 2;
constexpr std::uint16_t channels = 4;

/// Plays one gateway and the handlers, and checks each action.
class World {
 public:
  explicit World(std::uint32_t seed) : random_(seed) {}

  void step() {
    const auto channel = static_cast<std::uint16_t>(1 + pick(channels));
    switch (pick(6)) {
      case 0:
        call(channel);
        break;
      case 1:
        repeat(channel);
        break;
      case 2:
        withdraw(channel);
        break;
      default:
        finish();
    }
    EXPECT_LE(running_.size(), concurrency);
    EXPECT_EQ(running_.size(), sut_.running());
  }

  void finish_all() {
    while (!running_.empty()) {
      finish();
    }
    EXPECT_TRUE(sut_.idle());
    for (const auto& [channel, request] : pending_) {
      EXPECT_TRUE(request.assigned != self_ || replied_.contains(request.call))
          << "channel " << channel << " waits for ever";
    }
  }

 private:
  std::size_t pick(std::size_t count) { return random_() % count; }

  void call(std::uint16_t channel) {
    Request request{.key = {.machine = "cnc", .channel = channel},
                    .call = {.epoch = 1, .number = ++number_},
                    .assigned = pick(4) == 0 ? other_ : self_};
    pending_[channel] = request;
    perform(sut_.on_request(request, {}));
  }

  void repeat(std::uint16_t channel) {
    if (const auto pending = pending_.find(channel); pending != pending_.end()) {
      pending->second.attempt += static_cast<std::uint32_t>(pick(2));
      pending->second.assigned = pick(4) == 0 ? other_ : self_;
      perform(sut_.on_request(pending->second, {}));
    }
  }

  void withdraw(std::uint16_t channel) {
    pending_.erase(channel);
    perform(sut_.on_withdrawn({"cnc", channel}));
  }

  void finish() {
    if (running_.empty()) {
      return;
    }
    const auto done =
        std::next(running_.begin(), static_cast<std::ptrdiff_t>(pick(running_.size())));
    const CallId id = *done;
    running_.erase(done);
    perform(sut_.on_result(id, Response{.text = std::to_string(id.number)}, {}));
  }

  void perform(const Actions& actions) {
    for (const Action& action : actions) {
      if (const auto* start = std::get_if<Start>(&action)) {
        EXPECT_TRUE(ever_started_.insert(start->request.call).second) << "run twice";
        EXPECT_TRUE(is_pending(start->request.call)) << "started although nobody waits";
        running_.insert(start->request.call);
      } else if (const auto* send = std::get_if<Send>(&action)) {
        EXPECT_TRUE(is_pending(send->reply.call)) << "a stale reply overwrites that of its channel";
        EXPECT_EQ(send->reply.text, std::to_string(send->reply.call.number));
        replied_.insert(send->reply.call);
      }
    }
  }

  bool is_pending(CallId id) const {
    return std::any_of(pending_.begin(), pending_.end(),
                       [&](const auto& each) { return each.second.call == id; });
  }

  std::mt19937 random_;
  const fabric::InstanceId self_{{1}};
  const fabric::InstanceId other_{{2}};
  CallDesk sut_{{.instance = self_, .concurrency = concurrency}};
  std::uint64_t number_ = 0;
  std::map<std::uint16_t, Request> pending_;
  std::set<CallId> running_;
  std::set<CallId> ever_started_;
  std::set<CallId> replied_;
};

TEST(CallDeskAtRandom, RunsEachCallOnceAndAnswersEveryOneThatIsWanted) {
  for (std::uint32_t seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE(seed);
    World world(seed);
    for (int step = 0; step < 100; ++step) {
      world.step();
    }
    world.finish_all();
    ASSERT_FALSE(testing::Test::HasFailure());
  }
}

}  // namespace
}  // namespace millrace::services::sdk
