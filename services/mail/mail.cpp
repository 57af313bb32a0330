#include "services/mail/mail.hpp"

namespace millrace::services::mail {

namespace {

constexpr int first_temporary = 400;
constexpr int first_permanent = 500;

std::string words(const Exchange& exchange) {
  return exchange.code >= first_temporary ? exchange.reply : exchange.trouble_text;
}

}  // namespace

Outcome outcome_of(const Exchange& exchange) {
  const bool temporary = exchange.code >= first_temporary && exchange.code < first_permanent;
  const bool permanent = exchange.code >= first_permanent;
  if (exchange.trouble == ConnectionError::none) {
    return {.verdict = Verdict::accepted, .reply = exchange.reply};
  }
  if (exchange.handed_over && !(exchange.replied_after && (temporary || permanent))) {
    return {.verdict = Verdict::doubt, .reply = exchange.trouble_text};
  }
  // A server may refuse STARTTLS for a while: 454 (RFC 3207, 4).
  if (exchange.trouble == ConnectionError::tls && !temporary) {
    return {.verdict = Verdict::insecure, .reply = exchange.trouble_text};
  }
  if (exchange.trouble == ConnectionError::login) {
    return {.verdict = temporary ? Verdict::later : Verdict::login, .reply = words(exchange)};
  }
  if (permanent) {
    return {.verdict = Verdict::refused, .reply = exchange.reply};
  }
  // A server that does not even send its greeting in time counts as not reachable.
  const bool silent = exchange.trouble == ConnectionError::timeout && exchange.code == 0;
  return {.verdict = Verdict::later,
          .reply = words(exchange),
          .contact = exchange.trouble != ConnectionError::no_contact && !silent,
          .stalled = exchange.trouble == ConnectionError::timeout && !silent};
}

}  // namespace millrace::services::mail
