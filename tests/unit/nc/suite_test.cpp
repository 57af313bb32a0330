// Runs every NC program of tests/data/nc/suite in virtual time and compares its output with its
// expected one. With MILLRACE_WRITE_EXPECTED in the environment it writes that text instead.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "tests/support/sections.hpp"
#include "tests/unit/nc/scenario.hpp"

namespace millrace::cnc::nc::test {
namespace {

using tests::Section;

void write_expected(const Section& section, const std::string& outcome) {
  std::ifstream in(section.file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string heading = "\n-- expected\n";
  const auto begin = text.find(heading, text.find("== " + section.name + '\n')) + heading.size();
  const auto end = std::min(text.find("\n== ", begin - 1), text.size());
  text.replace(begin, end - begin, outcome);
  std::ofstream(section.file, std::ios::binary) << text;
}

class NcSuite : public testing::TestWithParam<Section> {};

TEST_P(NcSuite, ComesOutAsExpected) {
  const std::string outcome = run_scenario(GetParam());
  if (std::getenv("MILLRACE_WRITE_EXPECTED") != nullptr) {
    write_expected(GetParam(), outcome);
    return;
  }
  EXPECT_EQ(GetParam().text("expected"), outcome);
}

INSTANTIATE_TEST_SUITE_P(Programs, NcSuite,
                         testing::ValuesIn(tests::read_sections_in(MILLRACE_TEST_DATA "/nc/suite")),
                         [](const auto& section) { return section.param.name; });

}  // namespace
}  // namespace millrace::cnc::nc::test
