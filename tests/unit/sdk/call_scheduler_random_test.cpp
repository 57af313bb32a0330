// The call scheduler with gateways that repeat, reassign, withdraw and replace calls, and come and
// go, at random.
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "services/sdk/call_scheduler.hpp"

namespace millrace::services::sdk {
namespace {

using fabric::CallId;
using fabric::Request;
using fabric::RequestKey;

constexpr std::size_t calls_at_once = 2;
constexpr std::uint16_t channels = 4;
/// The result of a cancelled handler.
const std::string garbage = "stopped";

/// Plays two gateways, each of which may regard a channel as its own, and the handlers, and checks
/// each action.
class World {
 public:
  explicit World(std::uint32_t seed) : random_(seed) {}

  void step() {
    const RequestKey key{
        {"cnc", static_cast<std::uint16_t>(1 + pick(channels))}, 1 + pick(2), self_};
    switch (pick(8)) {
      case 0:
        call(key);
        break;
      case 1:
        repeat(key);
        break;
      case 2:
        withdraw(key);
        break;
      case 3:
        lose(key);
        break;
      default:
        finish();
    }
    EXPECT_LE(running_.size(), calls_at_once);
    EXPECT_EQ(running_.size(), sut_.running());
  }

  void finish_all() {
    while (!running_.empty()) {
      finish();
    }
    EXPECT_TRUE(sut_.idle());
    for (const auto& [key, request] : pending_) {
      EXPECT_TRUE(request.assigned != self_ || lost_.contains(key) ||
                  replied_.contains(request.call))
          << key.key.to_string() << " waits for ever for gateway " << key.epoch;
    }
  }

 private:
  std::size_t pick(std::size_t count) { return random_() % count; }

  void call(const RequestKey& key) {
    pending_[key] = Request{.key = key.key,
                            .call = {.epoch = key.epoch, .number = ++number_},
                            .assigned = self_,
                            .may_wait = pick(4) != 0};
    ask(key);
  }

  void repeat(const RequestKey& key) {
    if (const auto pending = pending_.find(key); pending != pending_.end()) {
      pending->second.attempt += static_cast<std::uint32_t>(pick(2));
      ask(key);
    }
  }

  void ask(const RequestKey& key) {
    lost_.erase(key);
    perform(sut_.on_request(pending_.at(key), {}));
  }

  void withdraw(const RequestKey& key) {
    if (!lost_.contains(key)) {
      pending_.erase(key);
      perform(sut_.on_withdrawn(key));
    }
  }

  /// A gateway is not heard any more; its call remains until it returns.
  void lose(const RequestKey& key) {
    if (pending_.contains(key)) {
      lost_.insert(key);
    }
    perform(sut_.on_orphaned(key));
  }

  void finish() {
    if (running_.empty()) {
      return;
    }
    const auto done =
        std::next(running_.begin(), static_cast<std::ptrdiff_t>(pick(running_.size())));
    const CallId id = done->first;
    const bool cancelled = done->second;
    running_.erase(done);
    perform(
        sut_.on_result(id, Response{.text = cancelled ? garbage : std::to_string(id.number)}, {}));
  }

  void perform(const Actions& actions) {
    for (const Action& action : actions) {
      if (const auto* cancel = std::get_if<Cancel>(&action)) {
        EXPECT_FALSE(is_wanted(cancel->call)) << "withdrawn although its gateway waits";
        if (const auto running = running_.find(cancel->call); running != running_.end()) {
          running->second = true;
          ever_started_.erase(cancel->call);
        }
      } else if (const auto* start = std::get_if<Start>(&action)) {
        EXPECT_TRUE(ever_started_.insert(start->request.call).second) << "run twice";
        EXPECT_TRUE(is_pending(start->request.call)) << "started although its request is withdrawn";
        EXPECT_TRUE(running_.emplace(start->request.call, false).second)
            << "run again before its cancelled run has ended";
      } else if (const auto* send = std::get_if<Send>(&action)) {
        if (send->reply.kind == fabric::ReplyKind::declined) {
          EXPECT_FALSE(running_.contains(send->reply.call)) << "declined although it runs";
          EXPECT_FALSE(replied_.contains(send->reply.call)) << "declined although it is known";
          dispatch_to_another(send->reply.call);
          continue;
        }
        EXPECT_TRUE(is_pending(send->reply.call)) << "a stale reply overwrites that of its channel";
        EXPECT_EQ(send->reply.text, std::to_string(send->reply.call.number));
        replied_.insert(send->reply.call);
      }
    }
  }

  /// As a gateway does with a declined call.
  void dispatch_to_another(CallId id) {
    std::erase_if(pending_, [&](const auto& each) { return each.second.call == id; });
  }

  bool is_pending(CallId id) const {
    return std::any_of(pending_.begin(), pending_.end(),
                       [&](const auto& each) { return each.second.call == id; });
  }

  /// Its gateway is present and waits for the answer.
  bool is_wanted(CallId id) const {
    return std::any_of(pending_.begin(), pending_.end(), [&](const auto& each) {
      return each.second.call == id && !lost_.contains(each.first);
    });
  }

  std::mt19937 random_;
  const fabric::InstanceId self_{{1}};
  CallScheduler sut_{{.instance = self_, .concurrency = calls_at_once}};
  std::uint64_t number_ = 0;
  std::map<RequestKey, Request> pending_;
  std::set<RequestKey> lost_;
  /// The running calls, and whether they are cancelled.
  std::map<CallId, bool> running_;
  /// Except cancelled runs.
  std::set<CallId> ever_started_;
  std::set<CallId> replied_;
};

TEST(CallSchedulerAtRandom, RunsEachCallOnceExceptCancelledRunsAndAnswersEachRequestedOne) {
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
