#include "services/archiver/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

TEST(ArchiverConfig, ReadsEveryField) {
  const auto sut = load(data("good/plant.archiver.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->folder, "/var/lib/millrace/archive");
  EXPECT_FALSE(sut->record_events);
  EXPECT_FALSE(sut->record_channels);
  EXPECT_THAT(sut->without_text, testing::ElementsAre("fdeccc37-09ba-4ef6-bf20-2955ea738286"));
  EXPECT_EQ(sut->policy.rotate_bytes, 64U << 20U);
  EXPECT_EQ(sut->policy.rotate_age, 12h);
  EXPECT_EQ(sut->policy.keep_age, 720h);
  EXPECT_EQ(sut->policy.keep_bytes, 2048ULL << 20U);
}

TEST(ArchiverConfig, HasDefaults) {
  const Config sut = default_config("/srv");
  EXPECT_EQ(sut.folder, "/srv/archive");
  EXPECT_TRUE(sut.record_events);
  EXPECT_EQ(sut.policy.keep_age, 365 * 24h);
}

TEST(ArchiverConfig, AcceptsARelativePath) {
  const auto here = std::filesystem::current_path();
  const auto sut = load(std::filesystem::relative(data("good/plant.archiver.textproto"), here));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->folder, "/var/lib/millrace/archive");
  EXPECT_EQ(default_config("archives").folder, here / "archives/archive");
}

TEST(ArchiverConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("archiver", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::archiver
