// A test's own LCM program, written with liblcm: it does only what the test asks for.
//
//   LcmProgram program(uuid);                    // announces itself five times a second
//   const request_t call = program.await_request();
//   program.answer(call, "2");
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <millrace/drain_t.hpp>
#include <millrace/presence_t.hpp>
#include <millrace/reply_t.hpp>
#include <millrace/request_t.hpp>

#include "tests/integration/chain.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/own_network.hpp"

namespace millrace::tests::integration {

class LcmProgram {
 public:
  explicit LcmProgram(std::string uuid, const std::string& name = "speaker");
  ~LcmProgram();
  LcmProgram(const LcmProgram&) = delete;
  LcmProgram& operator=(const LcmProgram&) = delete;

  /// Ignores all requests, as if they were lost.
  void ignore_requests(bool ignores) { ignores_ = ignores; }
  /// Changes its presence. A request that it receives is in there until it is answered.
  void change(const std::function<void(presence_t&)>& change);

  /// The next request that the test has not awaited yet; also a repeated one that is not answered.
  request_t await_request();
  [[nodiscard]] std::size_t drains() const { return drains_; }

  [[nodiscard]] reply_t reply_to(const request_t& request, const std::string& text,
                                 std::int64_t state = 1) const;
  void send(const reply_t& reply);
  void answer(const request_t& request, const std::string& text, std::int64_t state = 1) {
    send(reply_to(request, text, state));
  }
  void publish(const std::string& channel, const std::string& bytes);
  [[nodiscard]] std::string reply_channel() const { return "MILLRACE_REPLY." + uuid_; }

 private:
  void run(const std::stop_token& stop);
  void announce();
  void take(const std::string& channel, const std::string& bytes);
  void forget(const std::string& call);

  const std::string uuid_;
  const std::int64_t number_;
  lcm_t* lcm_;
  std::mutex lock_;
  presence_t presence_{};
  std::vector<request_t> requests_;
  /// The last answer; sent again on a repeated request.
  reply_t answered_{};
  std::atomic<bool> ignores_ = false;
  std::atomic<std::size_t> drains_ = 0;
  std::jthread thread_;
};

// millrace-lcm with a chain, in a separate network, because LCM multicasts.

// The UUIDs of deploy/examples/lcm.
inline const std::string root_uuid = "6c1f3f0a-54a4-4a43-9b8d-2f3a8c1f7e51";
inline const std::string countdown_uuid = "0d7e3b1c-6f0c-4c39-8a55-0a2d9f4b7c66";
inline const std::string uuid = "e2b6ae2c-3d6a-4b7b-8f5d-1f6f0d3f9a10";

/// Before any test has threads.
class Network : public testing::Environment {
 public:
  void SetUp() override { obstacle = enter_own_network(); }
  inline static std::string obstacle;
};

inline const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

class Lcm : public testing::Test {
 protected:
  void SetUp() override {
    if (!Network::obstacle.empty()) {
      GTEST_SKIP() << Network::obstacle;
    }
  }

  void start(const std::string& configuration = {}, const Flags& flags = {}) {
    Flags command{binary("millrace-lcm"), "--domain", std::to_string(chain.domain()), "--log-level",
                  "debug"};
    if (!configuration.empty()) {
      std::ofstream(config) << configuration;
      command.insert(command.end(), {"--config", config.string()});
    }
    command.insert(command.end(), flags.begin(), flags.end());
    sut.emplace(std::move(command));
    sut->await("^ready: lcm serves LCM processes of udpm://239.255.76.67:7667\\?ttl=0 on domain");
  }
  [[nodiscard]] Caller& caller() {
    if (!caller_) {
      caller_.emplace(chain.domain());
    }
    return *caller_;
  }
  /// A gateway's request, once a program of `uuid` is present.
  fabric::Request ask(const std::string& text) {
    EXPECT_TRUE(caller().await_instance(uuid));
    fabric::Request request = caller().request(uuid, text);
    caller().publish(request);
    return request;
  }
  /// `millrace call`, which makes the same decisions as a gateway.
  [[nodiscard]] Process call(const std::string& of, const std::string& text) const {
    return chain.millrace({"call", of, text});
  }
  Chain chain;
  const std::filesystem::path config = chain.folder() / "lcm.textproto";
  std::optional<Process> sut;

 private:
  std::optional<Caller> caller_;
};

}  // namespace millrace::tests::integration
