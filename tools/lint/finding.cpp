#include "tools/lint/finding.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"

namespace millrace::tools::lint {

namespace {

using enum Severity;

constexpr std::array<RuleInfo, 28> all_rules{{
    {Rule::syntax, "syntax", error, "A block cannot be read"},
    {Rule::not_understood, "not-understood", hint,
     "A block has a word that only a controller knows"},
    {Rule::unknown_member, "unknown-member", error, "V.G.SERVICE has no such member"},
    {Rule::wrong_type, "wrong-type", error, "A number stands where a text belongs, or a text"},
    {Rule::state_range, "state-range", error,
     "REQUEST_STATE is not a whole number from 0 to 4294967295"},
    {Rule::no_uuid, "no-uuid", warning, "A request is made and nothing has written UUID"},
    {Rule::unknown_uuid, "unknown-uuid", error, "No service has the UUID in V.G.SERVICE.UUID"},
    {Rule::malformed_uuid, "malformed-uuid", warning, "V.G.SERVICE.UUID is nearly a UUID"},
    {Rule::text_too_long, "text-too-long", error, "A text has more than 127 bytes"},
    {Rule::text_charset, "text-charset", warning, "A text is not in the controller's code page"},
    {Rule::wait_without_timeout, "wait-without-timeout", hint, "A wait may last for ever"},
    {Rule::wait_without_flush, "wait-without-flush", warning,
     "A wait behind motion without #FLUSH may wait for ever"},
    {Rule::wait_before_request, "wait-before-request", error, "A wait for an answer to nothing"},
    {Rule::wait_for_nothing, "wait-for-nothing", error, "A wait that does not wait for the answer"},
    {Rule::answer_before_wait, "answer-before-wait", warning,
     "RESPONSE or RESPONSE_STATE is used before a wait"},
    {Rule::answer_not_checked, "answer-not-checked", warning,
     "A response is used without a check of RESPONSE_STATE"},
    {Rule::error_goes_on, "error-goes-on", warning,
     "RESPONSE is used whatever the check of RESPONSE_STATE has found"},
    {Rule::answer_not_awaited, "answer-not-awaited", warning,
     "The program ends, or asks again, without a wait for the answer"},
    {Rule::answer_written, "answer-written", error,
     "RESPONSE_STATE or RESPONSE is written while the request is pending"},
    {Rule::same_state_in_loop, "same-state-in-loop", warning,
     "The same request with the same REQUEST_STATE again and again"},
    {Rule::request_after_state, "request-after-state", error,
     "UUID or REQUEST is written while the request is pending"},
    {Rule::timer_missing, "timer-missing", error, "SysServiceWait.cyc with @P2 and without @P3"},
    {Rule::timer_range, "timer-range", error, "A timer is outside of 0 to 127"},
    {Rule::time_limit, "time-limit", warning, "@P2 is not a sensible time for a wait"},
    {Rule::shared_timer, "shared-timer", warning, "The same timer is used for two things"},
    {Rule::missing_subprogram, "missing-subprogram", hint,
     "A subprogram is missing, so its effect is unknown"},
    {Rule::misprinted_end, "misprinted-end", warning, "M30/ is written instead of M30"},
    {Rule::unknown_rule, "unknown-rule", warning, "A comment switches off an unknown rule"},
}};

}  // namespace

std::span<const RuleInfo> rules() {
  return all_rules;
}

const RuleInfo& about(Rule rule) {
  return all_rules.at(static_cast<std::size_t>(rule));
}

std::optional<Rule> rule_named(std::string_view name) {
  const auto* const found = std::ranges::find(all_rules, name, &RuleInfo::name);
  return found == all_rules.end() ? std::nullopt : std::optional(found->rule);
}

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"hint", "warning", "error"};
  return names.at(static_cast<std::size_t>(severity));
}

namespace {

constexpr std::string_view mark = "millrace-lint:";

/// The word in front, which is taken off together with what separates it.
std::string_view take_word(std::string_view& text) {
  constexpr std::string_view separators = " ,\t";
  const std::size_t begin = text.find_first_not_of(separators);
  if (begin == std::string_view::npos) {
    text = {};
    return {};
  }
  const std::size_t end = text.find_first_of(separators, begin);
  const std::string_view word = text.substr(begin, end - begin);
  text = end == std::string_view::npos ? std::string_view() : text.substr(end);
  return word;
}

}  // namespace

Suppressions::Suppressions(const std::string& file, std::string_view text) {
  int number = 1;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    read(file, text.substr(0, end), number++);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
}

void Suppressions::read(const std::string& file, std::string_view line, int number) {
  const std::size_t place = line.find(mark);
  if (place == std::string_view::npos) {
    return;
  }
  const std::string_view code = base::text::trim(line);
  const bool alone = code.starts_with('(') || code.starts_with(';');
  std::string_view rest = line.substr(place + mark.size());
  rest = base::text::trim(rest.substr(0, rest.find_first_of(")\r")));
  const std::string_view what = take_word(rest);
  std::set<Rule>* rules = nullptr;
  if (what == "off-file") {
    rules = &whole_file_;
  } else if (what == "off") {
    rules = &lines_[alone ? number + 1 : number];
  }
  const auto mistake = [&](std::string text) {
    mistakes_.push_back(
        {{file, number, static_cast<int>(place) + 1}, Rule::unknown_rule, std::move(text)});
  };
  if (rules == nullptr || rest.empty()) {
    mistake(R"(expected "millrace-lint: off RULE, …" or "millrace-lint: off-file RULE, …")");
    return;
  }
  while (!rest.empty()) {
    const std::string_view word = take_word(rest);
    if (const auto rule = rule_named(word)) {
      rules->insert(*rule);
    } else if (!word.empty()) {
      mistake(fmt::format("{} is not a rule; `millrace lint --rules` names them",
                          base::text::quoted(word)));
    }
  }
}

bool Suppressions::has(Rule rule, int line) const {
  const auto found = lines_.find(line);
  return whole_file_.contains(rule) || (found != lines_.end() && found->second.contains(rule));
}

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

boost::json::object json_of(const std::vector<Finding>& findings, std::size_t not_understood) {
  boost::json::array all;
  for (const Finding& finding : findings) {
    all.push_back({{"file", base::text::safe(finding.place.file)},
                   {"line", finding.place.line},
                   {"column", finding.place.column},
                   {"severity", name_of(severity_of(finding))},
                   {"rule", about(finding.rule).name},
                   {"text", base::text::safe(finding.text)}});
  }
  return {{"findings", std::move(all)}, {"not_understood", not_understood}};
}

boost::json::object sarif_of(const std::vector<Finding>& findings, std::size_t not_understood,
                             std::string_view version) {
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
                          {"results", std::move(results)},
                          {"properties", {{"notUnderstood", not_understood}}}};
  return {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
          {"version", "2.1.0"},
          {"runs", boost::json::array{std::move(run)}}};
}

std::string summary_of(const std::vector<Finding>& findings, std::size_t not_understood) {
  std::string summary;
  for (const Severity severity : {Severity::error, Severity::warning, Severity::hint}) {
    if (const std::size_t number = count(findings, severity); number > 0) {
      summary += (summary.empty() ? "" : ", ") + counted(number, name_of(severity));
    }
  }
  if (summary.empty()) {
    summary = "nothing found";
  }
  if (not_understood > 0) {
    summary += fmt::format("; {} {} not understood", counted(not_understood, "block"),
                           not_understood == 1 ? "was" : "were");
  }
  return summary;
}

bool fails(const std::vector<Finding>& findings, bool strict) {
  return count(findings, Severity::error) > 0 || (strict && count(findings, Severity::warning) > 0);
}

}  // namespace millrace::tools::lint
