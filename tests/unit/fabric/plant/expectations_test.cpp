#include "fabric/plant/expectations.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/fabric/plant/samples.hpp"

namespace millrace::fabric::plant {
namespace {

using namespace samples;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Expectations, AreGatewaysThatReport) {
  Plant plant;
  plant.add(machine("press", true));
  EXPECT_THAT(missing_gateways(plant, {"press", "vm"}), IsEmpty());
  EXPECT_THAT(missing_gateways(plant, {"mill"}), SizeIs(1));
  // A second gateway of the same host, which is lost.
  MachineStatus lathe{.machine = "lathe", .gateway = id(9), .host = "vm"};
  plant.add(entry(lathe));
  EXPECT_THAT(missing_gateways(plant, {"lathe"}), IsEmpty());
  lathe.gone = true;
  plant.add(entry(lathe));
  EXPECT_THAT(missing_gateways(plant, {"lathe"}), SizeIs(1));
  EXPECT_THAT(missing_gateways(plant, {"press", "vm"}), IsEmpty());
}

TEST(Expectations, AreInstancesThatTakeCalls) {
  Plant plant;
  plant.add(instance(1, "a"));
  EXPECT_THAT(missing_instances(plant, {{square_root, 1}, {"a", 1}}), IsEmpty());
  const auto missing = missing_instances(plant, {{square_root, 2}});
  ASSERT_THAT(missing, SizeIs(1));
  EXPECT_EQ(missing[0].kind, Kind::missing);
  EXPECT_EQ(missing[0].level, Level::act);
  EXPECT_EQ(missing[0].why.text, "1 of 2 expected instances");
  plant.add(instance(1, "a", true));
  EXPECT_THAT(missing_instances(plant, {{square_root, 1}}), SizeIs(1)) << "it drains";
}

}  // namespace
}  // namespace millrace::fabric::plant
