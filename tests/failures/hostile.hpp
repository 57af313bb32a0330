// A hostile participant without trust: it speaks DDS as any program does and breaks the rules of
// millrace. Each function does one thing once; for a flood, call it repeatedly.
//
//   Hostile hostile(domain);
//   hostile.overhear();
//   hostile.forge_reply();               // in the name of the instance that was asked last
//   hostile.claim("cnc", Time::max());
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/own_network.hpp"
#include "tests/support/unchecked_reply_writer.hpp"

namespace millrace::tests::failures {
using integration::Chain;
using integration::Flags;
using testing::HasSubstr;
using testing::Not;
using namespace fabric;
using namespace std::chrono_literals;

class Hostile {
 public:
  /// It attacks the calls of the service `uuid`.
  Hostile(std::uint32_t domain, std::string uuid);

  /// Takes the requests of gateways; the functions below use the last one.
  void overhear();
  [[nodiscard]] bool has_request() const { return has_request_; }

  /// A final answer to the last call, in the name of the instance that was asked.
  void forge_reply();
  /// The same with a NUL, with state 0, too long or of an unknown kind, in turn.
  void forge_bad_reply();
  /// A reply to a call that was never made, of a caller that does not exist, a different one each
  /// time.
  void answer_nothing();
  /// A request from a gateway that does not exist, to the instance that was asked last or, if
  /// `astray`, in its partition to another instance.
  void ask(bool astray);
  /// Publishes that a gateway has owned the machine since `since`.
  void claim(const std::string& machine, fabric::Time since, bool connected,
             const std::string& address = "\x1b[31mnowhere");
  /// Publishes a call in a channel of the machine; channel and call differ each time.
  void show_channel(const std::string& machine);
  /// A command about nothing that exists.
  void command();

  /// Announces the instance that was asked last a second time, as draining, and answers in its
  /// name.
  void impersonate();
  /// Reads requests as an instance with this identity.
  void announce(const fabric::InstanceId& instance, const std::string& uuid,
                const std::string& identity);
  /// Joins as an instance of this UUID, ready for calls, which it never answers.
  void join(const std::string& uuid);
  /// Takes back what announce() and join() have made.
  void leave() {
    announced_.clear();
    joined_.clear();
  }

 private:
  fabric::dds::Participant participant_;
  /// Impersonation needs a second participant: one that is another process.
  fabric::dds::Participant second_;
  std::string uuid_;
  fabric::wire::Reader<fabric::Request> requests_;
  fabric::wire::Writer<fabric::MachineStatus> machines_;
  fabric::wire::Writer<fabric::ChannelStatus> channels_;
  fabric::wire::Writer<fabric::Command> commands_;
  UncheckedReplyWriter replies_;
  fabric::Request last_{.key = {"cnc", 1}, .call = {1, 1}};
  bool has_request_ = false;
  std::uint64_t count_ = 0;
  std::map<fabric::InstanceId, fabric::wire::Writer<fabric::Request>> request_writers_;
  std::map<fabric::InstanceId, std::unique_ptr<UncheckedReplyWriter>> false_writers_;
  std::deque<fabric::wire::Reader<fabric::Request>> announced_;
  std::deque<fabric::wire::Writer<fabric::Reply>> joined_;
};

// A chain of programs in a separate network, with a hostile participant on it.
//
//   TEST_F(AHostileParticipant, …) { start(); Hostile sut(chain.domain(), slow_uuid); … }

inline const std::string slow_uuid = "c0ffee00-0000-4000-8000-000000000001";

inline constexpr std::uint32_t channels = 4;
inline constexpr std::uint32_t calls_of_each = 100;
/// The floods use cores that the calls may need.
inline constexpr std::chrono::seconds allowed{120};

/// Enters a separate network before any test has threads, so that nothing is sent elsewhere. For
/// testing::AddGlobalTestEnvironment().
class Network : public testing::Environment {
 public:
  void SetUp() override { obstacle = enter_own_network(); }
  inline static std::string obstacle;
};

inline std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// Does something at this rate, in a thread of its own, until it is destroyed; less often where the
/// machine does not manage the rate.
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

/// The durations of calls, from the gateway's events.
class Stopwatch {
 public:
  explicit Stopwatch(const dds::ParticipantOptions& join)
      : participant_(join), events_(participant_, "millrace", wire::Keep::all) {}

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

  /// Starts a controller whose programs call, and a gateway. The calls wait for start_services().
  void prepare(std::uint32_t calls = calls_of_each) {
    calls_ = calls;
    Flags flags{"--channels", std::to_string(channels)};
    const std::string program = chain.counting_program(slow_uuid, calls);
    for (std::uint32_t channel = 1; channel <= channels; ++channel) {
      flags.insert(flags.end(), {"--run", std::to_string(channel) + "=" + program});
    }
    cnc.emplace(chain.cnc(flags));
    gateway.emplace(chain.gateway({"--log-level", "debug"}));
    gateway->await_error("link up", allowed);
  }

  /// Starts two instances and waits for their first answer.
  void start_services(const std::string& delivery = "at-least-once") {
    for (const std::string name : {"one", "two"}) {
      services.push_back(
          chain.slow_service({"--name", name, "--work", "5", "--delivery", delivery}));
    }
    gateway->await_error("call .* answered with state", allowed);
  }

  void start(std::uint32_t calls = calls_of_each) {
    prepare(calls);
    start_services();
  }

  /// Each program gets all its answers, and only its own.
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

  /// Expects no control sequence of a terminal, and no line that is not an event.
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

}  // namespace millrace::tests::failures
