#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {
namespace {

using tests::at;
using tests::one_call;

const Entry request = one_call(17, 0)[1];
const Entry of_an_instance{.uuid = tests::square_root, .sample = InstanceNews{}};

TEST(RecordingFilter, AcceptsEverythingByDefault) {
  EXPECT_TRUE(Filter{}.takes(request));
  EXPECT_TRUE(Filter{}.takes(of_an_instance));
}

TEST(RecordingFilter, ChoosesByMachineAndChannel) {
  EXPECT_TRUE((Filter{.machines = {"cnc", "press"}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"press"}}.takes(request)));
  EXPECT_TRUE((Filter{.machines = {"cnc"}, .channels = {1}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"cnc"}, .channels = {2}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"cnc"}}.takes(of_an_instance)));
}

TEST(RecordingFilter, ChoosesByServiceKindAndCall) {
  EXPECT_TRUE((Filter{.uuids = {tests::square_root}}.takes(of_an_instance)));
  EXPECT_FALSE((Filter{.uuids = {"other"}}.takes(request)));
  EXPECT_TRUE((Filter{.kinds = {"request"}}.takes(request)));
  EXPECT_FALSE((Filter{.kinds = {"reply"}}.takes(request)));
  EXPECT_TRUE((Filter{.call = fabric::CallId{0x5f, 17}}.takes(request)));
  EXPECT_FALSE((Filter{.call = fabric::CallId{0x5f, 18}}.takes(request)));
}

TEST(RecordingFilter, ChoosesByTimeOfRecording) {
  EXPECT_TRUE((Filter{.from = at(1.1), .to = at(1.1)}.takes(request)));
  EXPECT_FALSE((Filter{.from = at(1.2)}.takes(request)));
  EXPECT_FALSE((Filter{.to = at(1)}.takes(request)));
}

}  // namespace
}  // namespace millrace::tools::recording
