#include "tools/commands/look/service_rows.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/commands/small_fabric.hpp"

namespace millrace::tools::commands::look {
namespace {

using namespace tests;
using namespace std::chrono_literals;
using recording::Change;
using testing::HasSubstr;
using testing::SizeIs;

const std::string laser = "11111111-6335-44a9-895a-8b27f3ed5e47";

std::vector<ServiceRow> rows_of(const std::vector<recording::Entry>& entries) {
  static bus::FabricModel sut;
  sut = {};
  for (const recording::Entry& entry : entries) {
    sut.add(entry);
  }
  return service_rows(sut, at(0));
}

TEST(ServiceRows, GroupTheInstancesOfAUuid) {
  const auto rows =
      rows_of({news(1, "a"), news(2, "b"),
               load({.instance = instance(1), .running = 1, .answered = 1, .mean = 4ms}),
               load({.instance = instance(2), .answered = 3, .failed = 2, .mean = 8ms})});
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_EQ(rows[0].uuid, square_root);
  EXPECT_EQ(rows[0].name, "a, b");
  EXPECT_THAT(rows[0].instances, SizeIs(2));
  EXPECT_EQ(rows[0].running, 1U);
  EXPECT_EQ(rows[0].capacity, 4U);
  EXPECT_EQ(rows[0].answered, 4U);
  EXPECT_EQ(rows[0].failed, 2U);
  EXPECT_EQ(rows[0].mean, 7ms);
  EXPECT_EQ(rows[0].problem, "");
}

TEST(ServiceRows, HaveNoMeanBeforeTheFirstAnswer) {
  EXPECT_EQ(rows_of({news(1, "a"), load({.instance = instance(1)})})[0].mean, std::nullopt);
}

TEST(ServiceRows, HaveProblemsFirstAndThenTheBusiest) {
  const auto rows = rows_of({news(1, "a", "aaaa"), news(2, "b", "bbbb"),
                             load({.instance = instance(2), .running = 1}),
                             channel(1, fabric::ChannelState::unserved, laser)});
  ASSERT_THAT(rows, SizeIs(3));
  EXPECT_EQ(rows[0].uuid, laser);
  EXPECT_EQ(rows[0].waiting, 1U);
  EXPECT_EQ(rows[0].problem, "no running instance");
  EXPECT_EQ(rows[1].name, "b");
  EXPECT_EQ(rows[2].name, "a");
}

TEST(ServiceRows, NameAnInstanceWithoutHeartbeat) {
  const auto rows = rows_of({news(1, "a"), news(2, "b"), news(2, "b", square_root, Change::gone)});
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_THAT(rows[0].instances, SizeIs(1));
  EXPECT_EQ(rows[0].problem, "b without heartbeat (vm, pid 0)");
}

}  // namespace
}  // namespace millrace::tools::commands::look
