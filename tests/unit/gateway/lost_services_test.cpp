#include "gateway/core/lost_services.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway::core {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

fabric::InstanceIdentity instance(std::uint8_t number) {
  fabric::InstanceIdentity one;
  one.id.bytes.fill(number);
  one.uuid = "weather";
  one.name = "w" + std::to_string(number);
  return one;
}

Moment after(std::chrono::seconds time) {
  return {SteadyTime(time), fabric::Time(time)};
}

TEST(LostServices, NameTheLastInstanceOfAServiceUntilAnotherOneComes) {
  LostServices sut;
  EXPECT_FALSE(sut.on_ready(instance(1)));
  EXPECT_FALSE(sut.on_ready(instance(2)));
  EXPECT_FALSE(sut.on_gone(instance(1).id, after(std::chrono::seconds(1))));
  const auto lost = sut.on_gone(instance(2).id, after(std::chrono::seconds(2)));
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->uuid, "weather");
  EXPECT_EQ(lost->last.name, "w2");
  EXPECT_EQ(lost->since, fabric::Time(std::chrono::seconds(2)));
  EXPECT_TRUE(sut.on_ready(instance(3)));
  EXPECT_FALSE(sut.on_ready(instance(3)));
}

TEST(LostServices, HaveNoneThatLeftInOrderOrWasNeverThere) {
  LostServices sut;
  auto draining = instance(1);
  sut.on_ready(draining);
  draining.draining = true;
  sut.on_ready(draining);
  EXPECT_FALSE(sut.on_gone(draining.id, after(std::chrono::seconds(1))));
  EXPECT_FALSE(sut.on_gone(instance(9).id, after(std::chrono::seconds(1))));
}

TEST(LostServices, AreForgottenAfterAQuarterOfAnHour) {
  LostServices sut;
  sut.on_ready(instance(1));
  ASSERT_TRUE(sut.on_gone(instance(1).id, after(std::chrono::seconds(0))));
  EXPECT_THAT(sut.on_time(after(LostServices::kept - std::chrono::seconds(1))), IsEmpty());
  EXPECT_THAT(sut.on_time(after(LostServices::kept)), ElementsAre("weather"));
  EXPECT_FALSE(sut.on_ready(instance(2)));
}

}  // namespace
}  // namespace millrace::gateway::core
