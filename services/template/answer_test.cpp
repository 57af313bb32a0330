// Tests of the handler, without a gateway and in milliseconds.
#include "answer.hpp"

#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "services/sdk/testing/fake_call.hpp"
#include "services/sdk/testing/loopback.hpp"

namespace sdk = millrace::services::sdk;
using millrace::fabric::ServiceCode;
using sdk::testing::FakeCall;
using sdk::testing::Loopback;

TEST(Answer, IsTheNumberOfBytes) {
  EXPECT_EQ(FakeCall({.text = "hello"}).run(answer)->text, "5");
}

TEST(Answer, RefusesARequestWithoutText) {
  EXPECT_EQ(FakeCall().run(answer)->text, "ERROR: expected a text");
}

TEST(Answer, SurvivesTheDeathOfAnInstance) {
  const sdk::ServiceOptions options{.uuid = "b3be5ea2-290f-452a-a581-bf9eecf7df26"};
  // Keeps its call, as a handler that has not finished.
  std::shared_ptr<const sdk::Call> kept;
  Loopback loopback;
  const auto lost = loopback.start(
      options, [&](std::shared_ptr<const sdk::Call> call) { kept = std::move(call); });
  auto pending = loopback.send({.uuid = options.uuid, .text = "hello"});
  loopback.start(options, answer);
  loopback.kill(lost);
  EXPECT_EQ(pending.wait()->text, "5");
  EXPECT_EQ(pending.attempt(), 2U);
}

TEST(Answer, IsRepeatedFromMemory) {
  const sdk::ServiceOptions options{.uuid = "b3be5ea2-290f-452a-a581-bf9eecf7df26"};
  Loopback loopback;
  loopback.start(options, answer);
  auto pending = loopback.send({.uuid = options.uuid, .text = "hello"});
  EXPECT_EQ(pending.wait()->code, ServiceCode::ok);
  pending.repeat();
  EXPECT_EQ(pending.wait()->code, ServiceCode::repeated);
}
