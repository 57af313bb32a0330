#include "tools/lint/report.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::tools::lint {

namespace {

Severity severity_of(const Finding& finding) {
  return about(finding.rule).severity;
}

std::size_t count(const std::vector<Finding>& findings, Severity severity) {
  return static_cast<std::size_t>(std::ranges::count(findings, severity, severity_of));
}

std::string counted(std::size_t number, std::string_view what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
}

/// SARIF knows no hints.
std::string_view level_of(Severity severity) {
  return severity == Severity::hint ? "note" : name_of(severity);
}

boost::json::object location_of(const Place& place) {
  return {{"physicalLocation",
           {{"artifactLocation", {{"uri", base::text::safe(place.file)}}},
            {"region", {{"startLine", place.line}, {"startColumn", place.column}}}}}};
}

}  // namespace

std::string text_of(const Finding& finding) {
  return fmt::format("{}:{}:{}: {}: {} [{}]\n", base::text::safe(finding.place.file),
                     finding.place.line, finding.place.column, name_of(severity_of(finding)),
                     base::text::safe(finding.text), about(finding.rule).name);
}

boost::json::array json_of(const std::vector<Finding>& findings) {
  boost::json::array out;
  for (const Finding& finding : findings) {
    out.push_back({{"file", base::text::safe(finding.place.file)},
                   {"line", finding.place.line},
                   {"column", finding.place.column},
                   {"severity", name_of(severity_of(finding))},
                   {"rule", about(finding.rule).name},
                   {"text", base::text::safe(finding.text)}});
  }
  return out;
}

boost::json::object sarif_of(const std::vector<Finding>& findings, std::string_view version) {
  boost::json::array known;
  for (const RuleInfo& rule : rules()) {
    known.push_back({{"id", rule.name},
                     {"shortDescription", {{"text", rule.summary}}},
                     {"defaultConfiguration", {{"level", level_of(rule.severity)}}}});
  }
  boost::json::array results;
  for (const Finding& finding : findings) {
    results.push_back({{"ruleId", about(finding.rule).name},
                       {"ruleIndex", static_cast<int>(finding.rule)},
                       {"level", level_of(severity_of(finding))},
                       {"message", {{"text", base::text::safe(finding.text)}}},
                       {"locations", boost::json::array{location_of(finding.place)}}});
  }
  boost::json::object driver{
      {"name", "millrace lint"}, {"version", version}, {"rules", std::move(known)}};
  boost::json::object run{{"tool", {{"driver", std::move(driver)}}},
                          {"results", std::move(results)}};
  return {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
          {"version", "2.1.0"},
          {"runs", boost::json::array{std::move(run)}}};
}

std::string summary_of(const std::vector<Finding>& findings) {
  std::string summary;
  for (const Severity severity : {Severity::error, Severity::warning, Severity::hint}) {
    if (const std::size_t number = count(findings, severity); number > 0) {
      summary += (summary.empty() ? "" : ", ") + counted(number, name_of(severity));
    }
  }
  return summary.empty() ? "nothing found" : summary;
}

bool fails(const std::vector<Finding>& findings, bool strict) {
  return count(findings, Severity::error) > 0 || (strict && count(findings, Severity::warning) > 0);
}

}  // namespace millrace::tools::lint
