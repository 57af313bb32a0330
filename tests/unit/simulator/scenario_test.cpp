#include "tests/unit/simulator/scenario.hpp"

#include <algorithm>
#include <cctype>

#include <gtest/gtest.h>

namespace millrace::cnc::simulator {
namespace {

class VirtualDevice : public testing::TestWithParam<Scenario> {};

TEST_P(VirtualDevice, AnswersAsWritten) {
  EXPECT_EQ(play(GetParam()), "");
}

std::string name_of(const testing::TestParamInfo<Scenario>& info) {
  std::string name = info.param.file + "__" + info.param.title;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Scenario, VirtualDevice, testing::ValuesIn(read_scenarios()), name_of);

}  // namespace
}  // namespace millrace::cnc::simulator
