#include <boost/json/serialize.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {
namespace {

const std::vector<Finding> findings{{{"part.nc", 12, 3}, Rule::timer_missing, "which timer"},
                                    {{"\x1b[2J.nc", 1, 1}, Rule::wait_without_flush, "may wait"},
                                    {{"part.nc", 2, 1}, Rule::wait_without_timeout, "for ever"}};

TEST(LintReport, WritesFindingsAsCompilersDo) {
  EXPECT_EQ(text_of(findings[0]), "part.nc:12:3: error: which timer [timer-missing]\n");
}

TEST(LintReport, EscapesTerminalControlsInFileNames) {
  EXPECT_EQ(text_of(findings[1]).find('\x1b'), std::string::npos);
}

TEST(LintReport, CountsWhatWasFound) {
  EXPECT_EQ(summary_of(findings), "1 error, 1 warning, 1 hint");
  EXPECT_EQ(summary_of({}), "nothing found");
}

TEST(LintReport, FailsForErrorsAndIfStrictForWarnings) {
  EXPECT_TRUE(fails(findings, false));
  EXPECT_FALSE(fails({findings[1], findings[2]}, false));
  EXPECT_TRUE(fails({findings[1]}, true));
  EXPECT_FALSE(fails({findings[2]}, true));
}

TEST(LintReport, NamesEachRuleOfASarifLogOnce) {
  const boost::json::object log = sarif_of(findings, "1.2.3");
  const auto& run = log.at("runs").at(0);
  const auto& known = run.at_pointer("/tool/driver/rules").as_array();
  ASSERT_EQ(known.size(), rules().size());
  for (const boost::json::value& result : run.at("results").as_array()) {
    const auto index = static_cast<std::size_t>(result.at("ruleIndex").as_int64());
    EXPECT_EQ(known.at(index).at("id"), result.at("ruleId"));
  }
  EXPECT_EQ(run.at_pointer("/results/2/level").as_string(), "note");
  EXPECT_EQ(run.at_pointer("/results/0/locations/0/physicalLocation/region/startLine").as_int64(),
            12);
}

}  // namespace
}  // namespace millrace::tools::lint
