#include "gateway/dispatch/near_miss.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"
#include "base/text/ascii.hpp"
#include "fabric/messages.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::dispatch {

namespace {

/// How the nearest UUID differs from the one in the NC program.
fabric::Message difference(std::string_view written, std::string_view meant) {
  const std::size_t edits = base::text::edit_distance(written, meant);
  if (edits != 1) {
    return base::messages::characters_differ(edits);
  }
  if (written.size() < meant.size()) {
    return base::messages::one_character_missing();
  }
  return written.size() > meant.size() ? base::messages::one_character_too_many()
                                       : base::messages::one_character_differs();
}

/// Canonical, and in lower case even where it is not a UUID, so that the case makes no difference.
std::string comparable(std::string_view uuid) {
  std::string text = fabric::canonical_uuid(uuid);
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

bool uuid_character(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F') || c == '-';
}

}  // namespace

std::optional<std::string> nearest(std::string_view text, const std::vector<std::string>& known) {
  constexpr std::size_t most_edits = 4;
  std::optional<std::string> best;
  std::size_t best_edits = most_edits + 1;
  for (const std::string& candidate : known) {
    const std::size_t edits = base::text::edit_distance(text, candidate);
    if (edits < best_edits) {
      best = candidate;
      best_edits = edits;
    }
  }
  return best;
}

fabric::Message malformed(std::string_view uuid) {
  constexpr std::size_t length = 36;
  const std::string text = fabric::canonical_uuid(uuid);
  const auto dashes = std::ranges::count(text, '-');
  if (fabric::is_uuid(text) || dashes == 0 || text.size() < length / 2 ||
      text.size() > length + length / 2) {
    return {};
  }
  if (const auto wrong = std::ranges::find_if_not(text, uuid_character); wrong != text.end()) {
    return text.size() == length
               ? base::messages::not_hexadecimal(printable(std::string_view(&*wrong, 1)))
               : fabric::Message();
  }
  if (text.size() != length) {
    return base::messages::wrong_length_of_uuid(text.size(), length);
  }
  return base::messages::wrong_dashes();
}

fabric::Message explain_unserved(std::string_view uuid, const std::vector<std::string>& known) {
  const std::string written = comparable(uuid);
  if (written.empty()) {
    return base::messages::unknown_uuid_empty();
  }
  const std::string shown = printable(uuid);
  const auto meant = nearest(written, known);
  const fabric::Message wrong = malformed(uuid);
  if (meant && !wrong.empty()) {
    return base::messages::unknown_uuid_near_malformed(shown, *meant, difference(written, *meant),
                                                       wrong);
  }
  if (meant) {
    return base::messages::unknown_uuid_near(shown, *meant, difference(written, *meant));
  }
  return wrong.empty() ? base::messages::unknown_uuid(shown)
                       : base::messages::unknown_uuid_malformed(shown, wrong);
}

}  // namespace millrace::gateway::dispatch
