#include "services/mail/answering.hpp"

#include <algorithm>

#include "base/text/cp1252.hpp"

namespace millrace::services::mail {

namespace {

using sdk::Response;
using text::error;

/// The server's reply may contain any bytes; the NC program gets printable characters of its code
/// page.
std::string shown(const std::string& reply) {
  std::string text = base::text::to_cp1252(reply).value_or(reply);
  std::replace_if(
      text.begin(), text.end(), [](char c) { return !text::prints(c); }, '?');
  return text;
}

Response kept(const std::string& reply) {
  return {.text = text::fitting("sent later: " + shown(reply)), .state = state_kept};
}

}  // namespace

std::chrono::milliseconds pause_after(std::uint32_t attempts, const RetryPolicy& policy) {
  std::chrono::milliseconds pause = policy.first;
  for (std::uint32_t i = 1; i < attempts && pause < policy.longest; ++i) {
    pause *= 2;
  }
  return std::min(pause, policy.longest);
}

std::optional<Entry> after(Entry entry, const Outcome& outcome, const RetryPolicy& policy,
                           bool program_waits, fabric::Time now) {
  ++entry.attempts;
  entry.reply = outcome.reply;
  switch (outcome.verdict) {
    case Verdict::accepted:
      entry.stage = Stage::accepted;
      entry.mail = {};
      return entry;
    case Verdict::refused:
      entry.stage = Stage::refused;
      if (program_waits) {
        // The NC program has the response; only the call must be remembered.
        entry.mail = {};
      }
      return entry;
    case Verdict::doubt:
      entry.stage = Stage::handed_over;
      return entry;
    case Verdict::insecure:
    case Verdict::login:
      if (program_waits) {
        return std::nullopt;
      }
      break;
    case Verdict::later:
      break;
  }
  // Time without any attempt does not count: the service was down, or the clock jumped.
  const auto late = now - entry.next;
  if (entry.next != fabric::Time{} &&
      late > std::max<std::chrono::nanoseconds>(policy.longest, std::chrono::hours(1))) {
    entry.made += late;
  }
  entry.stage = now - entry.made >= policy.give_up ? Stage::given_up : Stage::waiting;
  entry.next = now + pause_after(entry.attempts, policy);
  return entry;
}

Response answer_to(const Outcome& outcome) {
  const std::string reply = shown(outcome.reply);
  switch (outcome.verdict) {
    case Verdict::accepted:
      return {.text = "OK", .state = text::state_ok};
    case Verdict::later:
      return kept(outcome.reply);
    case Verdict::refused:
      return error(state_refused, "the mail server refuses: " + reply);
    case Verdict::insecure:
      return error(state_insecure, "no safe connection to the mail server: " + reply);
    case Verdict::login:
      return error(state_no_login, "no login at the mail server: " + reply);
    case Verdict::doubt:
      break;
  }
  return error(state_doubt, "sent, but no answer of the mail server; not sent again: " + reply);
}

Response answer_from(const Entry& entry) {
  switch (entry.stage) {
    case Stage::waiting:
      return answer_to({.verdict = Verdict::later, .reply = entry.reply});
    case Stage::handed_over:
      return answer_to({.verdict = Verdict::doubt, .reply = entry.reply});
    case Stage::accepted:
      return answer_to({.verdict = Verdict::accepted});
    case Stage::refused:
      return answer_to({.verdict = Verdict::refused, .reply = entry.reply});
    case Stage::given_up:
      break;
  }
  return error(state_refused, "given up: " + shown(entry.reply));
}

}  // namespace millrace::services::mail
