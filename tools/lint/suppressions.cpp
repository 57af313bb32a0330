#include "tools/lint/suppressions.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "base/text/trim.hpp"

namespace millrace::tools::lint {

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

}  // namespace millrace::tools::lint
