#include "tools/commands/status/expectations.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/command_line.hpp"
#include "tests/unit/tools/commands/small_fabric.hpp"

namespace millrace::tools::commands::status {
namespace {

using namespace tests;
using fabric::plant::Concern;
using fabric::plant::Kind;
using fabric::plant::Level;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Expectations, AreGatewaysAndInstancesThatAreMissing) {
  fabric::plant::Plant plant;
  plant.add(machine("press", true));
  plant.add(news(1, "a"));
  EXPECT_THAT(missing_gateways(plant, {"press", "vm"}), IsEmpty());
  EXPECT_THAT(missing_gateways(plant, {"mill"}), SizeIs(1));
  // A second gateway of the same host, which is lost.
  fabric::MachineStatus lathe{.machine = "lathe", .host = "vm"};
  lathe.gateway.bytes.fill(9);
  plant.add({.sample = lathe});
  EXPECT_THAT(missing_gateways(plant, {"lathe"}), IsEmpty());
  lathe.gone = true;
  plant.add({.sample = lathe});
  EXPECT_THAT(missing_gateways(plant, {"lathe"}), SizeIs(1));
  EXPECT_THAT(missing_gateways(plant, {"press", "vm"}), IsEmpty());
  EXPECT_THAT(missing_instances(plant, {{square_root, 1}, {"a", 1}}), IsEmpty());
  const auto missing = missing_instances(plant, {{square_root, 2}});
  ASSERT_THAT(missing, SizeIs(1));
  EXPECT_EQ(missing[0].why.text, "1 of 2 expected instances");
  EXPECT_EQ(exit_code_of(missing), base::program::exit_failed);
}

TEST(TheExitCode, IsTheLowestOfTheConcernsThatNeedSomebody) {
  EXPECT_EQ(exit_code_of(Concerns{}), 0);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::held, .level = Level::look}}), 0);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::program_aborted}, {.kind = Kind::alarm}}),
            exit_alarm);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::waiting}, {.kind = Kind::link_down}}),
            exit_link_down);
  for (const auto& [kind, code] :
       std::vector<std::pair<Kind, int>>{{Kind::missing, base::program::exit_failed},
                                         {Kind::no_gateway, exit_link_down},
                                         {Kind::gateway_gone, exit_link_down},
                                         {Kind::held, exit_held},
                                         {Kind::unserved, exit_unserved},
                                         {Kind::journal, exit_alarm},
                                         {Kind::program_aborted, exit_program_aborted}}) {
    EXPECT_EQ(exit_code_of(Concern{.kind = kind}), code) << name_of(kind);
  }
}

}  // namespace
}  // namespace millrace::tools::commands::status
