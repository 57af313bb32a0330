#include "gateway/variables/write_rules.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "cnc/variables/names.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::variables {

namespace {

constexpr std::string_view service_interface = "V.G.SERVICE";

/// In upper case, without characters that some reader may skip.
std::string canonical(std::string_view name) {
  std::string text;
  for (const char c : name) {
    if (c > ' ' && c <= '~') {
      text += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    }
  }
  return text;
}

/// '*' stands for any characters, also for none.
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0;
  std::size_t n = 0;
  std::size_t star = std::string_view::npos;
  std::size_t behind = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      behind = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++behind;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

bool lets(const WriteRule& rule, std::uint16_t channel, std::string_view name) {
  return (rule.channels.empty() ||
          std::ranges::find(rule.channels, channel) != rule.channels.end()) &&
         matches(rule.pattern, name);
}

}  // namespace

bool is_service_interface(std::string_view name) {
  const std::string text = canonical(name);
  if (!text.starts_with(service_interface)) {
    return false;
  }
  const char next = text.size() > service_interface.size() ? text[service_interface.size()] : '.';
  const bool goes_on = (next >= 'A' && next <= 'Z') || (next >= '0' && next <= '9') || next == '_';
  return !goes_on;
}

std::string objection(const WriteRules& rules, std::uint16_t channel, std::string_view name) {
  if (is_service_interface(name)) {
    return fmt::format(
        "{} is never written over the fabric: only the NC program and its gateway write it; "
        "'millrace answer' and 'millrace retry' act on a pending call",
        printable(name));
  }
  if (cnc::variables::family_of(name).empty()) {
    return fmt::format("{} may not be written: only variables of {} may; all others are read-only",
                       printable(name), fmt::join(cnc::variables::families, ", "));
  }
  if (std::ranges::any_of(rules,
                          [&](const WriteRule& rule) { return lets(rule, channel, name); })) {
    return {};
  }
  return fmt::format(
      "{0} may not be written: the gateway's configuration does not list it; variables {{ write: "
      "\"{0}\" }} does",
      printable(name));
}

std::string wrong_pattern(const std::string& pattern) {
  if (is_service_interface(pattern)) {
    return fmt::format(
        "\"{}\"; V.G.SERVICE is never written: only NC programs and their gateway write it; "
        "expected another variable, as in \"V.E.*\"",
        printable(pattern));
  }
  const bool plain = std::ranges::all_of(pattern, [](char c) { return c > ' ' && c <= '~'; });
  // The text before the first '*' names the family: "*" alone would be everything.
  if (!plain || cnc::variables::family_of(pattern).empty()) {
    return fmt::format(
        "\"{}\"; expected a variable as programs write it, in which * stands for any "
        "characters: \"V.E.LIMIT\", \"V.E.*\", \"P10\"",
        printable(pattern));
  }
  return {};
}

}  // namespace millrace::gateway::variables
