// A stranger on a fabric without trust, who says whatever he likes, as often as he can: the calls
// of others are answered, no machine is taken away, no memory stays, and no log is written full.
#include "tests/failures/hostile.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <iostream>
#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/ends/reply_end.hpp"
#include "fabric/registry/identity_text.hpp"
#include "fabric/reply_keys.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/own_network.hpp"

namespace millrace::tests::failures {
namespace {

using integration::Chain;
using integration::Flags;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using namespace fabric;
using namespace std::chrono_literals;

const std::string slow_uuid = "c0ffee00-0000-4000-8000-000000000001";

constexpr std::uint32_t channels = 4;
constexpr std::uint32_t calls_of_each = 100;
/// The floods take cores that the calls may need.
constexpr std::chrono::seconds allowed{120};

/// Before any test has threads: what is sent here goes nowhere else.
class Network : public testing::Environment {
 public:
  void SetUp() override { obstacle = enter_own_network(); }
  inline static std::string obstacle;
};

const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// Does something at this rate, in a thread of its own, until its end; at most so often, where the
/// machine does not manage it.
class Flood {
 public:
  Flood(std::size_t per_second, const std::function<void(std::size_t)>& act)
      : thread_([this, per_second, act] {
          const auto start = std::chrono::steady_clock::now();
          while (!over_) {
            const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
            const auto due =
                static_cast<std::size_t>(passed.count() * static_cast<double>(per_second));
            for (std::size_t i = 0; done_ < due && i < 1000; ++i) {
              act(done_++);
            }
            std::this_thread::sleep_for(1ms);
          }
        }) {}
  ~Flood() { end(); }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;

  void end() {
    over_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  [[nodiscard]] std::size_t done() const { return done_; }

 private:
  std::atomic<bool> over_ = false;
  std::atomic<std::size_t> done_ = 0;
  std::thread thread_;
};

/// How long calls took, by what the gateway tells of them.
class Stopwatch {
 public:
  explicit Stopwatch(std::uint32_t domain)
      : participant_({.domain = domain}), events_(participant_, "millrace", wire::Keep::all) {}

  void take() {
    for (auto batch = events_.take(); !batch.empty(); batch = events_.take()) {
      for (const wire::Taken<Event>& taken : batch) {
        if (!taken.valid) {
          continue;
        }
        if (taken.value.kind == EventKind::seen) {
          seen_.emplace(taken.value.call, taken.value.at);
        } else if (taken.value.kind == EventKind::written) {
          if (const auto from = seen_.find(taken.value.call); from != seen_.end()) {
            times_.push_back(
                std::chrono::duration<double, std::milli>(taken.value.at - from->second).count());
          }
        }
      }
    }
  }

  /// "400 calls, p50 25.1 ms, p99 31.0 ms"
  std::string result() {
    take();
    if (times_.empty()) {
      return "no calls";
    }
    std::ranges::sort(times_);
    const auto at = [&](double part) {
      return times_.at(static_cast<std::size_t>(part * static_cast<double>(times_.size() - 1)));
    };
    return fmt::format("{} calls, p50 {:.1f} ms, p99 {:.1f} ms", times_.size(), at(0.5), at(0.99));
  }

 private:
  dds::Participant participant_;
  wire::Reader<Event> events_;
  std::map<CallId, Time> seen_;
  std::vector<double> times_;
};

class AHostileParticipant : public testing::Test {
 protected:
  void SetUp() override {
    if (!Network::obstacle.empty()) {
      GTEST_SKIP() << Network::obstacle;
    }
  }

  /// Two instances, a controller whose programs call them, a gateway.
  void start(std::uint32_t calls = calls_of_each) {
    calls_ = calls;
    services.push_back(chain.slow_service({"--name", "one", "--work", "5"}));
    services.push_back(chain.slow_service({"--name", "two", "--work", "5"}));
    Flags flags{"--channels", std::to_string(channels)};
    const std::string program = chain.counting_program(slow_uuid, calls);
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      flags.insert(flags.end(), {"--run", std::to_string(channel) + "=" + program});
    }
    cnc.emplace(chain.cnc(flags));
    gateway.emplace(chain.gateway());
    gateway->await_error("call .* answered with state", allowed);
  }

  /// Each program gets its own answers, all of them.
  void expect_calls_unharmed() {
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      cnc->await(
          "\\[ch" + std::to_string(channel) + "\\] " + std::to_string(calls_) + " calls answered",
          allowed);
    }
    EXPECT_THAT(cnc->output(), Not(HasSubstr("wrong answer")));
    for (Process& service : services) {
      EXPECT_TRUE(service.running());
    }
    EXPECT_TRUE(gateway->running());
  }

  /// Nothing that controls a terminal, and no line that is no event of its own.
  static void expect_clean(const std::string& text) {
    EXPECT_THAT(text, Not(HasSubstr("\x1b")));
    EXPECT_THAT(text, Not(HasSubstr("\x07")));
    EXPECT_THAT(text, Not(HasSubstr("\nforged line")));
  }

  Chain chain;
  std::vector<Process> services;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::uint32_t calls_ = 0;
};

// What was once believed: 85 of 400 replies in another's name.
TEST_F(AHostileParticipant, ForgesAnswersFloodsAndImpersonatesAndEveryCallIsAnsweredAllTheSame) {
  start();
  Hostile sut(chain.domain(), slow_uuid);
  Stopwatch watch(chain.domain());
  await("a request that is overheard", [&] {
    sut.overhear();
    return sut.has_heard();
  });
  const std::size_t before = lines_of(gateway->error_output());
  Flood replies(20'000, [&](std::size_t i) {
    sut.overhear();
    switch (i % 10) {
      case 0:
        sut.forge_reply();
        break;
      case 1:
        sut.forge_bad_reply();
        break;
      case 2:
        sut.impersonate();
        break;
      case 3:
        sut.ask(i % 1000 != 3);
        break;
      case 4:
        sut.command();
        break;
      default:
        sut.answer_nothing();
        break;
    }
    if (i % 64 == 0) {
      watch.take();
    }
  });
  expect_calls_unharmed();
  replies.end();
  std::cout << "beside " << replies.done() << " hostile samples: " << watch.result() << '\n';
  EXPECT_GT(replies.done(), 5000U);
  const std::string said = gateway->error_output();
  expect_clean(said);
  EXPECT_THAT(said, AllOf(HasSubstr("in the name of instance"),
                          HasSubstr("is announced by two processes")));
  // Each call tells two or three lines of its own, at most.
  EXPECT_LT(lines_of(said) - before, std::size_t{4} * channels * calls_of_each + 300);
  EXPECT_THAT(said, Not(HasSubstr("it is draining")));
}

// One such sample stopped a machine, and the other one made the next gateway wait for ever.
TEST_F(AHostileParticipant, TakesNoMachineAwayWithClaimsThatNobodyCanHaveMade) {
  start();
  Hostile sut(chain.domain(), slow_uuid);
  {
    const Flood claims(2000, [&](std::size_t i) {
      sut.claim("cnc", i % 2 == 0 ? Time(1ns) : Time::max(), i % 4 < 2);
      if (i % 4 == 0) {
        sut.claim("machine\x1b[2J" + std::to_string(i),
                  Time(std::chrono::sys_days{std::chrono::year{2024} / 1 / 1}), true);
      }
      sut.show_channel("elsewhere");
    });
    expect_calls_unharmed();
    gateway->await_error("claims it since a time at which there was no gateway", allowed);
    // Whoever comes now is not kept away either.
    Process second = chain.gateway();
    second.await_error("serves it already; this gateway stands by", allowed);
    gateway->kill();
    second.await_error("taken over", allowed);
    expect_clean(second.error_output());
    EXPECT_LT(lines_of(second.error_output()), 200U);
  }
  expect_clean(gateway->error_output());
  EXPECT_EQ(gateway->error_output().find("stands by"), std::string::npos);
}

TEST_F(AHostileParticipant, LeavesNoMemoryBehindWhateverComesAndGoes) {
  start(2);
  Hostile sut(chain.domain(), slow_uuid);
  constexpr int uuids = 500;
  std::vector<double> resident;
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < uuids; ++i) {
      sut.join(InstanceId::random().to_string());
    }
    // Who is announced last is seen last.
    const InstanceId last = InstanceId::random();
    sut.announce(last, "last", "millrace-instance 2\nid=" + last.to_string() + "\nuuid=other\n");
    if (round == 0) {
      gateway->await_error("an instance that serves last is ignored", allowed);
    }
    Process looked = chain.millrace({"services", "--json"});
    EXPECT_EQ(looked.wait(allowed), 0) << looked.error_output();
    sut.leave();
    await(
        "the gateway to answer a ping after it",
        [&] {
          Process ping = chain.millrace({"health"});
          return ping.wait(allowed) == 0;
        },
        allowed);
    resident.push_back(bench::resident_mib(gateway->pid()));
  }
  std::cout << fmt::format("the gateway's memory after each round of {} UUIDs: {:.1f} MiB\n", uuids,
                           fmt::join(resident, ", "));
  EXPECT_THAT(gateway->error_output(), HasSubstr("is ready: passer-by"));
  // 10 kB for each UUID that ever was made 20 MB of this.
  EXPECT_LT(resident.back() - resident.front(), 5.0);
}

TEST_F(AHostileParticipant, AnnouncesWhatNoInstanceIsAndIsSaidToOnceAndShownToNoTerminal) {
  start(2);
  Hostile sut(chain.domain(), slow_uuid);
  const std::size_t before = lines_of(gateway->error_output());
  const auto announce = [&](const std::string& uuid, std::string more) {
    const InstanceId id = InstanceId::random();
    sut.announce(id, uuid,
                 fmt::format("millrace-instance 2\nid={}\nuuid={}\n{}", id.to_string(), uuid,
                             std::move(more)));
  };
  for (int i = 0; i < 300; ++i) {
    // As long as DDS lets them be, nonsense in each way.
    announce("long", "name=" + std::string(60'000, 'x') + "\n");
    announce("channels", "channels=" + std::string(60'000, '\x1b') + "\n");
  }
  announce("escapes", "name=%1B[2J%0Agateway info  all is well\ndescription=%1B]0;owned%07\n");
  gateway->await_error("an instance that serves long is ignored", allowed);
  expect_clean(gateway->error_output());
  EXPECT_LT(lines_of(gateway->error_output()) - before, 150U);
  EXPECT_LT(gateway->error_output().size(), 200'000U);
  for (const Flags& command : {Flags{"services"}, Flags{"services", "--json"}, Flags{"doctor"}}) {
    Process shown = chain.millrace(command);
    shown.wait(allowed);
    expect_clean(shown.output());
    expect_clean(shown.error_output());
  }
}

// Cyclone keeps 0.6 kB of each key until its writer is gone: 192 MB after 15 s of this.
TEST_F(AHostileParticipant, AnswersCallsOfEverNewCallersAndFillsNoMemory) {
  start(2);
  Hostile sut(chain.domain(), slow_uuid);
  await("a request that is overheard", [&] {
    sut.overhear();
    return sut.has_heard();
  });
  const auto flood = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      sut.answer_nothing();
      if (i % 64 == 0) {
        // A writer keeps what is not acknowledged yet.
        std::this_thread::yield();
      }
    }
  };
  const auto pinged = [&] {
    await(
        "the gateway to answer a ping",
        [&] {
          Process ping = chain.millrace({"health"});
          return ping.wait(allowed) == 0;
        },
        allowed);
    return bench::resident_mib(gateway->pid());
  };
  flood(ReplyKeys::most_others + 4000);
  gateway->await_error("replies to calls that nobody asked here, of more than 16384", allowed);
  const double full = pinged();
  flood(30'000);
  const double fuller = pinged();
  std::cout << fmt::format(
      "the gateway's memory at the bound and after 30,000 keys more: {:.1f}, "
      "{:.1f} MiB\n",
      full, fuller);
  // 0.6 kB of each were 18 MiB.
  EXPECT_LT(fuller - full, 6.0);
  // And who is asked is heard.
  Process call = chain.millrace({"call", slow_uuid, "still there"});
  EXPECT_EQ(call.wait(allowed), 0) << call.error_output();
  EXPECT_THAT(call.output(), HasSubstr("still there"));
}

// An instance of another vendor's DDS, or of a later version.
TEST_F(AHostileParticipant, AnswersItsOwnCallWithAKindThatNobodyKnowsAndTheProgramIsTold) {
  const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const InstanceIdentity odd{.id = InstanceId::random(), .uuid = uuid, .name = "odd"};
  dds::Participant participant({.domain = chain.domain()});
  LawlessWriter replies(participant, wire::service_partition("millrace", uuid),
                        registry::format_instance(odd.id));
  wire::Reader<Request> requests(participant, wire::mailbox_partition("millrace", uuid, odd.id),
                                 wire::Keep::all, {.user_data = registry::format_identity(odd)});
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")}));
  gateway.emplace(chain.gateway());
  std::optional<Request> asked;
  await("the call", [&] {
    for (const wire::Taken<Request>& taken : requests.take()) {
      if (taken.valid) {
        asked = taken.value;
      }
    }
    return asked.has_value();
  });
  replies.write({.key = asked->key,
                 .instance = odd.id,
                 .call = asked->call,
                 .attempt = asked->attempt,
                 .text = "1.7",
                 .state = 1},
                77);
  cnc->await("response = ERROR: the service's answer is of a kind that this gateway does not know");
  cnc->await("state = 500");
  gateway->await_error("is of a kind that this gateway does not know");
}

}  // namespace
}  // namespace millrace::tests::failures
