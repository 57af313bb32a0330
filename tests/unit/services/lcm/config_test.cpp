#include "services/lcm/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"

namespace millrace::services::lcm {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

TEST(LcmConfig, StaysOnThisHostByDefault) {
  const auto sut = load(data("good/empty.lcm.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->network.group, "239.255.76.67");
  EXPECT_EQ(sut->network.port, 7667);
  EXPECT_EQ(sut->network.ttl, 0);
  EXPECT_EQ(sut->network.interface, "127.0.0.1");
  EXPECT_EQ(sut->rules.silence, 1s);
  EXPECT_TRUE(sut->rules.any_uuid);
  EXPECT_FALSE(sut->mirror);
}

TEST(LcmConfig, ReadsEveryField) {
  const auto sut = load(data("good/full.lcm.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->network.group, "239.1.2.3");
  EXPECT_EQ(sut->network.port, 7668);
  EXPECT_EQ(sut->network.ttl, 1);
  EXPECT_EQ(sut->network.interface, "192.168.7.1");
  EXPECT_EQ(sut->rules.silence, 2s);
  EXPECT_FALSE(sut->rules.any_uuid);
  const ServiceRule* const rule = sut->rules.find("560aacbf-6335-44a9-895a-8b27f3ed5e47");
  ASSERT_NE(rule, nullptr);
  EXPECT_THAT(rule->channels, ElementsAre(fabric::ChannelScope{"cnc", 1}));
  EXPECT_EQ(rule->delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(rule->concurrency, 4U);
  EXPECT_EQ(rule->encoding, Encoding::cp1252);
  ASSERT_TRUE(sut->mirror);
  EXPECT_THAT(sut->mirror->without_text, ElementsAre("b536e110-ca9e-4198-bddb-64331366bedb"));
}

TEST(LcmConfig, NamesEachMistakeWithItsPlace) {
  millrace::tests::expect_mistakes("lcm", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::lcm
