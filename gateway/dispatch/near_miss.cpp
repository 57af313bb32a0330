#include "gateway/dispatch/near_miss.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "fabric/messages.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::dispatch {

namespace {

/// How the nearest UUID differs from the one in the NC program.
std::string difference(std::string_view written, std::string_view meant) {
  const std::size_t edits = base::text::edit_distance(written, meant);
  if (edits != 1) {
    return fmt::format("{} characters differ", edits);
  }
  if (written.size() < meant.size()) {
    return "one character is missing";
  }
  return written.size() > meant.size() ? "one character is too many" : "one character differs";
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
  for (const std::string& one : known) {
    const std::size_t edits = base::text::edit_distance(text, one);
    if (edits < best_edits) {
      best = one;
      best_edits = edits;
    }
  }
  return best;
}

std::string malformed(std::string_view uuid) {
  constexpr std::size_t length = 36;
  const std::string text = fabric::canonical_uuid(uuid);
  const auto dashes = std::ranges::count(text, '-');
  if (fabric::is_uuid(text) || dashes == 0 || text.size() < length / 2 ||
      text.size() > length + length / 2) {
    return {};
  }
  if (const auto wrong = std::ranges::find_if_not(text, uuid_character); wrong != text.end()) {
    return text.size() == length ? fmt::format("'{}' is not a hexadecimal digit",
                                               printable(std::string_view(&*wrong, 1)))
                                 : std::string();
  }
  if (text.size() != length) {
    return fmt::format("{} characters, a UUID has {}", text.size(), length);
  }
  return "its dashes are in the wrong places";
}

std::string explain_unserved(std::string_view uuid, const std::vector<std::string>& known) {
  const std::string written = comparable(uuid);
  if (written.empty()) {
    return "V.G.SERVICE.UUID is empty; the program must write its service's UUID before "
           "REQUEST_STATE";
  }
  std::string words = fmt::format("no service has the UUID {}", printable(uuid));
  if (const auto meant = nearest(written, known)) {
    words += fmt::format("; did you mean {}, {}", *meant, difference(written, *meant));
  }
  if (const std::string wrong = malformed(uuid); !wrong.empty()) {
    words += fmt::format("; it is malformed: {}", wrong);
  }
  return words;
}

}  // namespace millrace::gateway::dispatch
