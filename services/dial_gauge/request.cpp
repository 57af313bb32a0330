#include "services/dial_gauge/request.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "services/text/answer.hpp"
#include "services/text/fields.hpp"
#include "services/text/words.hpp"

namespace millrace::services::dial_gauge {

namespace {

constexpr std::array<std::pair<std::string_view, Verb>, 4> verbs{
    {{"READ", Verb::read}, {"ZERO", Verb::zero}, {"LIST", Verb::list}, {"STATUS", Verb::status}}};

std::optional<Verb> verb_of(std::string_view word) {
  const std::string upper = text::upper_case(word);
  const auto* const found = std::find_if(verbs.begin(), verbs.end(),
                                         [&](const auto& entry) { return entry.first == upper; });
  return found == verbs.end() ? std::nullopt : std::optional(found->second);
}

tl::unexpected<std::string> expected_form(std::string_view text) {
  return tl::unexpected("expected READ gauge [mm], ZERO|STATUS gauge or LIST, got " +
                        text::in_quotes(text));
}

}  // namespace

bool is_gauge_name(std::string_view name) {
  return text::is_name(name);
}

tl::expected<Request, std::string> parse(std::string_view text) {
  const auto words = text::words(text);
  const auto verb = words.empty() ? std::nullopt : verb_of(words[0]);
  if (!verb) {
    return expected_form(text);
  }
  const bool bare = *verb == Verb::read && words.size() == 3 && text::upper_case(words[2]) == "MM";
  const std::size_t expected_words = *verb == Verb::list ? 1 : bare ? 3 : 2;
  if (words.size() != expected_words) {
    return expected_form(text);
  }
  if (*verb == Verb::list) {
    return Request{.verb = *verb, .gauge = {}};
  }
  if (!is_gauge_name(words[1])) {
    return tl::unexpected("no gauge can be called " + text::in_quotes(words[1]));
  }
  return Request{.verb = *verb, .gauge = std::string(words[1]), .bare = bare};
}

}  // namespace millrace::services::dial_gauge
