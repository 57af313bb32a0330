// Runs every folder of tests/data/nc/suite in virtual time and compares its output with its
// expected.txt. With MILLRACE_WRITE_EXPECTED in the environment it writes that file instead.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/unit/nc/scenario.hpp"

namespace millrace::cnc::nc::test {
namespace {

const std::filesystem::path suite = std::filesystem::path(MILLRACE_TEST_DATA) / "nc" / "suite";

std::vector<std::string> scenarios() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(suite)) {
    if (entry.is_directory()) {
      names.push_back(entry.path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

class NcSuite : public testing::TestWithParam<std::string> {};

TEST_P(NcSuite, ComesOutAsExpected) {
  const auto folder = suite / GetParam();
  const std::string outcome = run_scenario(folder);
  if (std::getenv("MILLRACE_WRITE_EXPECTED") != nullptr) {
    std::ofstream(folder / "expected.txt", std::ios::binary) << outcome;
  }
  EXPECT_EQ(read_file(folder / "expected.txt"), outcome);
}

INSTANTIATE_TEST_SUITE_P(Programs, NcSuite, testing::ValuesIn(scenarios()),
                         [](const auto& scenario) { return scenario.param; });

}  // namespace
}  // namespace millrace::cnc::nc::test
