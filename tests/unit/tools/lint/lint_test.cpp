// Each program of tests/data/lint/*.txt, with its expected findings: lines "LINE RULE", or
// "FILE:LINE RULE" for a subprogram.
#include "tools/lint/lint.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <boost/json/serialize.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/sections.hpp"
#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Finds the other texts of a section as files beside its program.
auto texts_of(const tests::Section& section) {
  return [&section](const std::string& name) {
    const auto text = section.texts.find(name);
    return text == section.texts.end() ? std::nullopt : std::optional(Source{name, text->second});
  };
}

std::vector<Finding> lint(const std::string& text, LintOptions options = {}) {
  return lint(std::vector<Source>{{"part.nc", text}}, options).findings;
}

std::vector<Rule> rules_of(const std::vector<Finding>& findings) {
  std::vector<Rule> rules;
  for (const Finding& finding : findings) {
    rules.push_back(finding.rule);
  }
  return rules;
}

class Programs : public testing::TestWithParam<tests::Section> {};

TEST_P(Programs, HaveTheFindingsThatAreExpected) {
  const Source program{GetParam().name + ".nc", GetParam().text()};
  std::string found;
  for (const Finding& finding :
       lint(std::vector<Source>{program}, {.load = texts_of(GetParam())}).findings) {
    const std::string file = finding.place.file == program.name ? "" : finding.place.file + ":";
    found += file + std::to_string(finding.place.line) + " " +
             std::string(about(finding.rule).name) + "\n";
  }
  EXPECT_EQ(found, GetParam().text("expected"));
}

INSTANTIATE_TEST_SUITE_P(Lint, Programs,
                         testing::ValuesIn(tests::read_sections_in(tests::test_data("lint"))),
                         [](const auto& program) { return program.param.name; });

std::string read_all(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// The findings of a new rule in programs that were written before it.
TEST(Lint, FindsInTheProgramsOfTheRepositoryWhatIsWrongThereAndNothingElse) {
  const std::filesystem::path top(MILLRACE_SOURCE);
  std::vector<std::filesystem::path> files;
  for (const char* const part : {"deploy/nc", "tests/data/nc"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(top / part)) {
      if (entry.path().extension() == ".nc") {
        files.push_back(entry.path());
      }
    }
  }
  std::ranges::sort(files);
  std::size_t programs = 0;
  std::string found;
  const auto add_findings = [&](const Source& program, const auto& beside) {
    ++programs;
    // The programs of the suite are full of deliberate language errors, which its own tests check.
    for (const Finding& finding :
         lint(std::vector<Source>{program},
              {.load = beside,
              .off = {Rule::syntax, Rule::not_understood, Rule::wait_without_timeout}})
             .findings) {
      found += finding.place.file + ":" + std::to_string(finding.place.line) + " " +
               std::string(about(finding.rule).name) + "\n";
    }
  };
  for (const auto& file : files) {
    add_findings({std::filesystem::relative(file, top).string(), read_all(file)},
                 [&](const std::string& name) {
                   const std::string text = read_all(file.parent_path() / name);
                   return text.empty() ? std::nullopt : std::optional(Source{name, text});
                 });
  }
  for (const auto& section : tests::read_sections_in(tests::test_data("nc/suite"))) {
    for (const auto& [name, text] : section.texts) {
      if (name.empty() || name.ends_with(".nc")) {
        const std::string file = std::filesystem::relative(section.file, top).string();
        add_findings({file + ":" + section.name + (name.empty() ? "" : "/") + name, text},
                     texts_of(section));
      }
    }
  }
  ASSERT_GT(programs, 100U);
  EXPECT_EQ(found, read_all(tests::test_data("lint/repository.expected")));
}

TEST(Lint, NamesTheServiceThatWasMeant) {
  const std::string program = "V.G.SERVICE.UUID = \"560AACBF-6335-44a9-895A-B27F3ED5E47\"\nM30\n";
  const auto findings = lint(program, {.uuids = {{"560aacbf-6335-44a9-895a-8b27f3ed5e47"}}});
  ASSERT_THAT(rules_of(findings), ElementsAre(Rule::unknown_uuid));
  EXPECT_THAT(findings[0].text, HasSubstr("560aacbf-6335-44a9-895a-8b27f3ed5e47"));
}

TEST(Lint, IgnoresTheCaseOfAUuid) {
  EXPECT_THAT(lint("V.G.SERVICE.UUID = \"560AACBF-6335-44a9-895A-8B27F3ED5E47\"\nM30\n",
                   {.uuids = {{"560aacbf-6335-44a9-895a-8b27f3ed5e47"}}}),
              IsEmpty());
}

TEST(Lint, FindsTimersThatChannelsShare) {
  const std::string program = "#TIMER START [ID=3]\n#TIMER START [ID=4]\nM30\n";
  const std::string other = "#TIMER START [ID=5]\n#TIMER START [ID=4]\nM30\n";
  const std::vector<Source> programs{{"one.nc", program}, {"other.nc", other}};
  EXPECT_THAT(lint(programs, {}).findings, IsEmpty());
  const auto findings = lint(programs, {.channels = true}).findings;
  ASSERT_THAT(findings, SizeIs(1));
  EXPECT_EQ(findings[0].place, (Place{"other.nc", 2, 1}));
  EXPECT_THAT(findings[0].text, HasSubstr("timer 4"));
  EXPECT_THAT(findings[0].text, HasSubstr("one.nc"));
}

TEST(Lint, LeavesOutWhatIsSwitchedOff) {
  EXPECT_THAT(lint("#WAIT FOR V.G.SERVICE.RESPONSE_STATE == 1\nM30\n",
                   {.off = {Rule::wait_without_timeout}}),
              SizeIs(1));
}

TEST(Lint, CountsTheBlocksThatItDoesNotUnderstandWhateverIsOff) {
  const LintOptions off{.off = {Rule::syntax, Rule::not_understood}};
  std::string text = "#CONTOUR MODE ON [DEV PATH_DEV 0.5]\nG999\n$IF P1 >\n$ENDIF\n";
  for (int i = 0; i < 300; ++i) {
    text += "#SPECIAL\n";
  }
  const Report report = lint(std::vector<Source>{{"part.nc", text + "M30\n"}}, off);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_EQ(summary_of(report.findings, report.not_understood),
            "nothing found; 302 blocks were not understood");
}

TEST(Lint, ChecksACallBehindAMistakeWithTheMistakeSwitchedOff) {
  const std::string text = "#SPECIAL [5]\n$IF P1 >\n$ENDIF\nV.G.SERVICE.REQUEST_STATE = -1\nM30\n";
  EXPECT_THAT(rules_of(lint(text, {.off = {Rule::syntax, Rule::not_understood}})),
              testing::Contains(Rule::state_range));
}

TEST(Lint, HasAnInfoForEachRuleInItsPlace) {
  for (const RuleInfo& rule : rules()) {
    EXPECT_EQ(&about(rule.rule), &rule);
    EXPECT_EQ(rule_named(rule.name), rule.rule);
  }
}

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
  EXPECT_EQ(summary_of({findings[0]}, 1), "1 error; 1 block was not understood");
}

TEST(LintReport, FailsForErrorsAndIfStrictForWarnings) {
  EXPECT_TRUE(fails(findings, false));
  EXPECT_FALSE(fails({findings[1], findings[2]}, false));
  EXPECT_TRUE(fails({findings[1]}, true));
  EXPECT_FALSE(fails({findings[2]}, true));
}

TEST(LintReport, CountsInJsonTheBlocksThatWereNotUnderstood) {
  const boost::json::object none = json_of({}, 2);
  EXPECT_TRUE(none.at("findings").as_array().empty());
  EXPECT_EQ(none.at("not_understood"), 2);
  EXPECT_EQ(json_of(findings, 0).at("findings").as_array().size(), findings.size());
}

TEST(LintReport, NamesEachRuleOfASarifLogOnce) {
  const boost::json::object log = sarif_of(findings, 4, "1.2.3");
  const auto& run = log.at("runs").at(0);
  const auto& known = run.at_pointer("/tool/driver/rules").as_array();
  ASSERT_EQ(known.size(), rules().size());
  for (const boost::json::value& result : run.at("results").as_array()) {
    const auto index = static_cast<std::size_t>(result.at("ruleIndex").as_int64());
    EXPECT_EQ(known.at(index).at("id"), result.at("ruleId"));
  }
  EXPECT_EQ(run.at_pointer("/properties/notUnderstood"), 4);
  EXPECT_EQ(run.at_pointer("/results/2/level").as_string(), "note");
  EXPECT_EQ(run.at_pointer("/results/0/locations/0/physicalLocation/region/startLine").as_int64(),
            12);
}

}  // namespace
}  // namespace millrace::tools::lint
