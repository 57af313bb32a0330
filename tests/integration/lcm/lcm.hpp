// millrace-lcm with a chain, in a separate network, because LCM multicasts.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/integration/lcm/lcm_program.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/own_network.hpp"

namespace millrace::tests::integration {

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
    sut->await("^ready: lcm serves LCM programs of udpm://239.255.76.67:7667\\?ttl=0 on domain");
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
