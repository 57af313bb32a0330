#include "tools/lint/finding.hpp"

#include <algorithm>
#include <array>

namespace millrace::tools::lint {

namespace {

using enum Severity;

constexpr std::array<RuleInfo, 27> all_rules{{
    {Rule::syntax, "syntax", error, "The program cannot be read"},
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

}  // namespace millrace::tools::lint
