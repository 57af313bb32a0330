// Heartbeats, declines and answers of participants that have nothing to do with the calls, 10,000 a
// second. The calls are not affected, and the log reports it once.
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tests/integration/chain.hpp"

namespace millrace::tests::failures {
namespace {

using integration::Chain;
using integration::Flags;
using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;
using namespace fabric;

const std::string slow_uuid = "c0ffee00-0000-4000-8000-000000000001";
const std::string other_uuid = "0b5e55ed-0000-4000-8000-000000000001";

constexpr std::uint32_t channels = 4;
constexpr std::uint32_t calls_of_each = 40;
/// The flood uses a core that the calls may need.
constexpr std::chrono::seconds allowed{90};

std::size_t times(const std::string& text, const std::string& words) {
  std::size_t found = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) {
    ++found;
  }
  return found;
}

/// Does something ten times in each millisecond, in a thread of its own, until it is destroyed.
class TenThousandASecond {
 public:
  explicit TenThousandASecond(const std::function<void()>& act)
      : thread_([this, act] {
          auto next = std::chrono::steady_clock::now();
          while (!over_) {
            for (int i = 0; i < 10; ++i) {
              act();
              ++done_;
            }
            next += std::chrono::milliseconds(1);
            std::this_thread::sleep_until(next);
          }
        }) {}
  ~TenThousandASecond() {
    over_ = true;
    thread_.join();
  }
  TenThousandASecond(const TenThousandASecond&) = delete;
  TenThousandASecond& operator=(const TenThousandASecond&) = delete;

  [[nodiscard]] std::size_t done() const { return done_; }

 private:
  std::atomic<bool> over_ = false;
  std::atomic<std::size_t> done_ = 0;
  std::thread thread_;
};

/// Two instances, a controller whose programs call them, and a hostile participant: this process.
class AStranger : public testing::Test {
 protected:
  void start() {
    services.push_back(chain.slow_service({"--name", "one", "--work", "20"}));
    services.push_back(chain.slow_service({"--name", "two", "--work", "20"}));
    Flags flags{"--channels", std::to_string(channels)};
    const std::string program = chain.counting_program(slow_uuid, calls_of_each);
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      flags.insert(flags.end(), {"--run", std::to_string(channel) + "=" + program});
    }
    cnc.emplace(chain.cnc(flags));
    gateway.emplace(chain.gateway({"--log-level", "debug"}));
    gateway->await_error("call .* answered with state");
    for (int i = 0; i < 2; ++i) {
      const std::string id = gateway
                                 ->await_error("instance (\\S+) of " + slow_uuid +
                                               " is ready: " + (i == 0 ? "one" : "two"))
                                 .at(1);
      instances.push_back(InstanceId::parse(id).value());
    }
  }

  /// The last request of the programs' current calls.
  const Request& overheard() {
    for (const wire::Taken<Request>& taken : requests.take()) {
      if (taken.valid && !is_withdrawal(taken.value)) {
        last = taken.value;
      }
    }
    return last;
  }

  void expect_calls_unharmed() {
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      cnc->await("\\[ch" + std::to_string(channel) + "\\] " + std::to_string(calls_of_each) +
                     " calls answered",
                 allowed);
    }
    EXPECT_THAT(cnc->output(), Not(HasSubstr("wrong answer")));
    const auto executions = cluster::read_executions(chain.record());
    EXPECT_THAT(executions, SizeIs(std::size_t{2} * channels * calls_of_each));
    EXPECT_THAT(executions, Each(Field(&cluster::Execution::attempt, 1)));
    EXPECT_THAT(gateway->error_output(), Not(HasSubstr("is gone")));
  }

  Chain chain;
  std::vector<Process> services;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::vector<InstanceId> instances;
  dds::Participant participant{{.domain = chain.domain()}};
  wire::Reader<Request> requests{participant, wire::all_services("millrace"), wire::Keep::all};
  Request last{.call = {.epoch = 1, .number = 1}};
};

TEST_F(AStranger, ThatForgesHeartbeatsAndDeclinesIsIgnoredAndLoggedOnce) {
  start();
  const InstanceId own = InstanceId::random();
  wire::Writer<Heartbeat> heartbeats(participant, "millrace");
  wire::Writer<Reply> replies(participant, wire::service_partition("millrace", slow_uuid),
                              {.user_data = registry::format_instance(own)});
  {
    std::uint64_t number = 0;
    const TenThousandASecond flood([&] {
      const Request& asked = overheard();
      if (++number % 2 == 0) {
        // It has no room and has received none of the calls that it was assigned.
        InstanceLoad load{.status = {.waiting = 1}, .calls = {CallId{9, number}}};
        load.status.instance = instances[number / 2 % 2];
        static_cast<void>(heartbeats.write({.process = own, .loads = {load}}));
      } else {
        static_cast<void>(replies.write({.key = asked.key,
                                         .instance = asked.assigned,
                                         .call = asked.call,
                                         .attempt = asked.attempt,
                                         .kind = ReplyKind::declined,
                                         .text = "not I",
                                         .asked_text = asked.text,
                                         .asked_state = asked.state}));
      }
    });
    expect_calls_unharmed();
    testing::Test::RecordProperty("heartbeats and declines", std::to_string(flood.done()));
    EXPECT_GT(flood.done(), 5000U);
  }
  const std::string log = gateway->error_output();
  // Once, and after each minute a count of the further ones: a busy machine may take over a minute.
  EXPECT_GE(times(log, "from instance "), 1U);
  EXPECT_LE(times(log, "from instance "), 3U);
  EXPECT_LE(times(log, "a heartbeat of instance"), 3U);
}

/// Ignores all replies: a participant without requests may still reply.
struct IgnoringListener final : endpoints::ReplyEndpointListener {
  void on_request(const Request& /*request*/) override {}
  void on_withdrawn(const RequestKey& /*key*/) override {}
};

TEST_F(AStranger, ThatAnswersCallsOfOtherInstancesIsIgnoredAndRarelyLogged) {
  start();
  boost::asio::io_context context;
  IgnoringListener listener;
  const InstanceId own = InstanceId::random();
  endpoints::ReplyEndpoint end(participant, context.get_executor(),
                               {.id = own, .uuid = other_uuid, .name = "stranger"}, listener);
  gateway->await_error("is ready: stranger");
  {
    std::uint64_t number = 0;
    const TenThousandASecond flood([&] {
      const Request& asked = overheard();
      constexpr std::array kinds{ReplyKind::declined, ReplyKind::final, ReplyKind::interim};
      static_cast<void>(end.publish({.key = asked.key,
                                     .instance = own,
                                     .call = asked.call,
                                     .attempt = asked.attempt,
                                     .kind = kinds.at(++number % kinds.size()),
                                     .text = "wrong",
                                     .state = 7,
                                     .asked_text = asked.text,
                                     .asked_state = asked.state}));
    });
    expect_calls_unharmed();
    testing::Test::RecordProperty("declines and answers", std::to_string(flood.done()));
    EXPECT_GT(flood.done(), 5000U);
  }
  // Once for each channel in ten seconds.
  EXPECT_LE(times(gateway->error_output(), "was not dispatched to it"), 4U * channels);
  EXPECT_EQ(times(gateway->error_output(), "is too late"), 0U);
}

}  // namespace
}  // namespace millrace::tests::failures
