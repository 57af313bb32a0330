// Each documented form of the NC language, in tests/data/nc/forms.txt, and variants of it: the
// virtual CNC and lint agree whether it runs, is skipped with a note, or is not supported.
#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/nc/channel.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sections.hpp"
#include "tools/lint/finding.hpp"
#include "tools/lint/lint.hpp"

namespace millrace::tools::lint {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Each variable and each program exists.
class AnythingGoes : public cnc::nc::Environment {
 public:
  tl::expected<cnc::nc::Value, cnc::nc::Fault> read(std::string_view name) override {
    return variables_[std::string(name)];
  }
  tl::expected<void, cnc::nc::Fault> write(std::string_view name,
                                           const cnc::nc::Value& value) override {
    variables_[std::string(name)] = value;
    return {};
  }
  bool synchronous(std::string_view) override { return false; }
  tl::expected<std::string, cnc::nc::Fault> load(std::string_view name) override {
    return name == "cycle.nc" ? "P1 = @P1 * 2 X@P1\n$IF EXIST[@P2]\n$ENDIF\nG00 @X1\nM17\n"
                              : "M17\n";
  }

 private:
  std::map<std::string, cnc::nc::Value> variables_;
};

/// What became of a program: lines for mistakes, warnings and an early end.
struct Course {
  std::vector<std::string> mistakes;
  std::vector<std::string> warnings;
  std::string end = "did not end in an hour";
};

Course run(const std::string& program) {
  Course course;
  cnc::nc::Channel channel;
  if (const auto started = channel.start("form.nc", program); !started) {
    for (const cnc::nc::Diagnostic& mistake : started.error()) {
      course.mistakes.push_back(mistake.to_string());
    }
    course.end = "did not start";
    return course;
  }
  AnythingGoes environment;
  for (std::chrono::seconds now{}; channel.active() && now < std::chrono::hours(1); ++now) {
    for (const cnc::nc::Event& event : channel.tick(now, environment)) {
      if (const auto* const warning = std::get_if<cnc::nc::WarningEvent>(&event)) {
        course.warnings.push_back(warning->what.to_string());
      } else if (std::holds_alternative<cnc::nc::FinishedEvent>(event)) {
        course.end = "finished";
      } else if (const auto* const aborted = std::get_if<cnc::nc::AbortedEvent>(&event)) {
        course.end = aborted->why.to_string();
      } else if (std::holds_alternative<cnc::nc::HeldEvent>(event)) {
        channel.resume();
      }
    }
  }
  return course;
}

/// The findings of `rule`, as text.
std::string findings_of(const Report& report, Rule rule) {
  std::string text;
  for (const Finding& finding : report.findings) {
    text += finding.rule == rule ? text_of(finding) : "";
  }
  return text;
}

struct Form {
  /// runs, skipped, or "not supported: " and the words of the page.
  std::string verdict;
  std::string text;
};

std::ostream& operator<<(std::ostream& out, const Form& form) {
  return out << form.verdict << ":\n" << form.text;
}

std::vector<Form> forms() {
  std::vector<Form> all;
  for (const tests::Section& section : tests::read_sections(tests::test_data("nc/forms.txt"))) {
    for (const auto& [verdict, text] : section.texts) {
      std::istringstream lines(text);
      for (std::string line; std::getline(lines, line);) {
        if (line.starts_with('|')) {
          all.back().text += line.substr(std::min<std::size_t>(2, line.size())) + "\n";
        } else if (!line.empty()) {
          all.push_back({verdict, line + "\n"});
        }
      }
    }
  }
  return all;
}

std::string with(std::string text, std::string_view before, std::string_view instead) {
  for (std::size_t at = 0; (at = text.find(before, at)) != std::string::npos;
       at += instead.size()) {
    text.replace(at, before.size(), instead);
  }
  return text;
}

constexpr std::string_view added_name = "%ADDED_NAME\n";

bool names_programs(const std::string& form) {
  return form.starts_with('%') || form.find("\n%") != std::string::npos;
}

/// The same form as others would write it.
std::vector<std::string> variants(const std::string& form) {
  std::vector<std::string> all{form, with(form, "\n", "\r\n"), with(form, " ", " \t ")};
  if (!names_programs(form)) {
    all.push_back("\n(plant)\n" + std::string(added_name) + form);
  }
  // Names of variables and programs, and texts, are as they are written.
  const bool has_names = std::ranges::any_of(
      std::array{"V.", "Vs.", "NAME", "LL", "\""},
      [&form](const char* part) { return form.find(part) != std::string::npos; });
  if (!has_names) {
    std::string lower = form;
    std::ranges::transform(lower, lower.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    all.push_back(lower);
  }
  const bool is_one_block = form.find('\n') + 1 == form.size();
  if (is_one_block && form.find_first_of("%(;O/") != 0) {
    all.push_back(form.substr(0, form.size() - 1) + " ; comment \"\n");
    if (form.front() != 'N') {
      all.push_back("N4711 " + form);
      all.push_back("n010" + form);
      all.push_back("[LABEL_X] " + form);
    }
    all.push_back("$IF 1\n$FOR P99 = 1, 1, 1\n" + form + "$ENDFOR\n$ENDIF\n");
  }
  return all;
}

/// With the parameters that forms read.
std::string whole_program(const std::string& form) {
  const std::string parameters = "P1 = 1 P2 = 2 P3 = 0 P5 = 5 V.P.A = 1\n";
  const std::string end = "\nM30\n";
  if (const auto name = form.find(added_name); name != std::string::npos) {
    return std::string(form).insert(name + added_name.size(), parameters) + end;
  }
  return (names_programs(form) ? "" : parameters) + form + end;
}

class Forms : public testing::TestWithParam<Form> {
 protected:
  const std::string& verdict() const { return GetParam().verdict; }
};

TEST_P(Forms, RunAreSkippedOrAreNotSupportedAsThePageSays) {
  for (const std::string& variant : variants(GetParam().text)) {
    SCOPED_TRACE(variant);
    const Course course = run(whole_program(variant));
    if (verdict() == "runs" || verdict() == "skipped") {
      EXPECT_THAT(course.mistakes, IsEmpty());
      EXPECT_EQ(course.end, "finished");
      EXPECT_EQ(course.warnings.empty(), verdict() == "runs")
          << (course.warnings.empty() ? "no warning" : course.warnings.front());
    } else {
      EXPECT_EQ(course.end, "did not start");
    }
  }
}

TEST_P(Forms, AreForLintNeitherErrorsNorAnEndOfItsCheck) {
  constexpr std::string_view wrong_call = "\nV.G.SERVICE.REQUEST_STATE = -1\nM30\n";
  for (const std::string& variant : variants(GetParam().text)) {
    SCOPED_TRACE(variant);
    const Report report =
        lint(std::vector<Source>{{"form.nc", variant + std::string(wrong_call)}}, {});
    EXPECT_EQ(findings_of(report, Rule::syntax), "");
    EXPECT_NE(findings_of(report, Rule::state_range), "");
    const bool understood = verdict() == "runs" || verdict() == "skipped";
    EXPECT_EQ(findings_of(report, Rule::not_understood).empty(), understood)
        << findings_of(report, Rule::not_understood);
    EXPECT_EQ(report.not_understood == 0, understood);
  }
}

INSTANTIATE_TEST_SUITE_P(Nc, Forms, testing::ValuesIn(forms()));

TEST(FormsThatAreNotSupported, AreListedInThePage) {
  std::ifstream file(std::string(MILLRACE_SOURCE) + "/docs/reference/nc-language.md");
  std::ostringstream page;
  page << file.rdbuf();
  const std::string list = with(page.str().substr(page.str().find("**Not supported**")), "\n", " ");
  std::size_t count = 0;
  for (const Form& form : forms()) {
    constexpr std::string_view mark = "not supported: ";
    if (form.verdict.starts_with(mark)) {
      ++count;
      EXPECT_THAT(list, HasSubstr(form.verdict.substr(mark.size())));
    }
  }
  EXPECT_GT(count, 10U);
}

}  // namespace
}  // namespace millrace::tools::lint
