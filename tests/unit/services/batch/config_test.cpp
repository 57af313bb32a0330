#include "services/batch/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"

namespace millrace::services::batch {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

TEST(BatchConfig, FillsDefaults) {
  const auto sut = load(data("good/minimal.batch.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  ASSERT_EQ(sut->scripts.size(), 1U);
  const Script& script = sut->scripts[0];
  EXPECT_EQ(script.registration.uuid, "1b671a64-40d5-491e-99b0-da01ff1f3341");
  EXPECT_EQ(script.registration.name, "measure.sh");
  EXPECT_EQ(script.registration.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(script.program, data("good/measure.sh"));
  EXPECT_EQ(script.folder, data("good/"));
  EXPECT_EQ(script.time_limit, 30s);
  EXPECT_EQ(script.too_long, TooLong::refuse);
  EXPECT_EQ(script.encoding, Encoding::utf8);
}

TEST(BatchConfig, ReadsEveryField) {
  const auto sut = load(data("good/full.batch.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  const Script& script = sut->scripts.at(0);
  EXPECT_EQ(script.registration, (Registration{.uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341",
                                               .name = "measure",
                                               .description = "Measures a part",
                                               .delivery = fabric::Delivery::at_least_once,
                                               .concurrency = 4,
                                               .channels = {{"cnc", 1}, {"press", 0}}}));
  EXPECT_EQ(script.program, "/opt/cell/measure");
  EXPECT_THAT(script.arguments, ElementsAre("--fast", "--"));
  EXPECT_EQ(script.folder, "/srv/cell/work");
  EXPECT_EQ(script.time_limit, 5s);
  EXPECT_EQ(script.too_long, TooLong::cut);
  EXPECT_EQ(script.encoding, Encoding::cp1252);
  EXPECT_TRUE(script.accept_empty);
}

TEST(BatchConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("batch", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::batch
