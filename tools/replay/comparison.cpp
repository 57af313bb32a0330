#include "tools/replay/comparison.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace millrace::tools::replay {

namespace {

/// A piece of a text: a number, or the text between two numbers.
struct Piece {
  std::string_view text;
  std::optional<double> number;
};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// The length of the number at the start of `text`; 0 if there is none.
std::size_t number_length(std::string_view text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  std::size_t end = sign;
  while (end < text.size() && is_digit(text[end])) {
    ++end;
  }
  if (end < text.size() && text[end] == '.') {
    std::size_t fraction = end + 1;
    while (fraction < text.size() && is_digit(text[fraction])) {
      ++fraction;
    }
    // "3." is a number and a full stop.
    end = fraction > end + 1 ? fraction : end;
  }
  if (end == sign) {
    return 0;
  }
  if (end + 1 < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    std::size_t exponent = end + (text[end + 1] == '-' || text[end + 1] == '+' ? 2 : 1);
    const std::size_t first = exponent;
    while (exponent < text.size() && is_digit(text[exponent])) {
      ++exponent;
    }
    end = exponent > first ? exponent : end;
  }
  return end;
}

std::optional<double> parse(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value)
                                                                  : std::nullopt;
}

std::vector<Piece> pieces_of(std::string_view text) {
  std::vector<Piece> pieces;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = number_length(text.substr(i));
    if (length == 0) {
      ++i;
      continue;
    }
    if (i > begin) {
      pieces.push_back({text.substr(begin, i - begin), std::nullopt});
    }
    pieces.push_back({text.substr(i, length), parse(text.substr(i, length))});
    i += length;
    begin = i;
  }
  if (begin < text.size()) {
    pieces.push_back({text.substr(begin), std::nullopt});
  }
  return pieces;
}

bool close(double recorded, double got, const Tolerance& tolerance) {
  const double allowed =
      tolerance.relative ? std::abs(recorded) * tolerance.value : tolerance.value;
  // Decimal numbers are not exact in binary: 1.1 - 1.0 is a little more than 0.1.
  const double noise = 4e-16 * std::max(std::abs(recorded), std::abs(got));
  return std::abs(recorded - got) <= allowed + noise;
}

std::size_t first_difference(std::string_view a, std::string_view b) {
  const auto [left, right] = std::ranges::mismatch(a, b);
  return static_cast<std::size_t>(left - a.begin());
}

std::optional<Difference> compare_numbers(std::string_view recorded, std::string_view got,
                                          const Tolerance& tolerance) {
  const std::vector<Piece> left = pieces_of(recorded);
  const std::vector<Piece> right = pieces_of(got);
  for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
    if (i >= left.size() || i >= right.size()) {
      return Difference{"the text differs", first_difference(recorded, got)};
    }
    const auto at = static_cast<std::size_t>(right[i].text.data() - got.data());
    if (left[i].number && right[i].number) {
      if (!close(*left[i].number, *right[i].number, tolerance)) {
        return Difference{fmt::format("{} is not {} within {:g}{}", right[i].text, left[i].text,
                                      tolerance.relative ? tolerance.value * 100 : tolerance.value,
                                      tolerance.relative ? " %" : ""),
                          at};
      }
    } else if (left[i].text != right[i].text) {
      return Difference{"the text differs", at + first_difference(left[i].text, right[i].text)};
    }
  }
  return std::nullopt;
}

std::optional<Difference> compare_texts(const Answer& recorded, const Answer& got,
                                        const std::optional<Tolerance>& tolerance) {
  if (recorded.withheld) {
    if (tolerance || *recorded.withheld == got.text.size()) {
      return std::nullopt;
    }
    return Difference{
        fmt::format("the text had {} bytes and has {} now", *recorded.withheld, got.text.size()),
        std::nullopt};
  }
  if (recorded.text == got.text) {
    return std::nullopt;
  }
  if (tolerance) {
    return compare_numbers(recorded.text, got.text, *tolerance);
  }
  return Difference{"the text differs", first_difference(recorded.text, got.text)};
}

}  // namespace

tl::expected<void, std::string> Tolerances::add(std::string_view text) {
  const std::size_t equals = text.rfind('=');
  std::string_view number = equals == std::string_view::npos ? text : text.substr(equals + 1);
  Tolerance tolerance;
  if (number.ends_with('%')) {
    tolerance.relative = true;
    number.remove_suffix(1);
  }
  const auto value = parse(number);
  if (!value || !std::isfinite(*value) || *value < 0 || equals == 0) {
    return tl::unexpected(fmt::format(
        "'{}' is not a tolerance; expected NUMBER or NUMBER%, after UUID= for one service only",
        text));
  }
  tolerance.value = tolerance.relative ? *value / 100 : *value;
  if (equals == std::string_view::npos) {
    for_all_ = tolerance;
  } else {
    by_uuid_.insert_or_assign(fabric::canonical_uuid(text.substr(0, equals)), tolerance);
  }
  return {};
}

std::optional<Tolerance> Tolerances::of(const std::string& uuid) const {
  const auto own = by_uuid_.find(fabric::canonical_uuid(uuid));
  return own != by_uuid_.end() ? std::optional(own->second) : for_all_;
}

std::optional<Difference> compare(const Answer& recorded, const Answer& got,
                                  const std::optional<Tolerance>& tolerance) {
  auto difference = compare_texts(recorded, got, tolerance);
  if (recorded.state != got.state) {
    const std::string state = "the state differs";
    if (!difference) {
      return Difference{state, std::nullopt};
    }
    difference->what += ", and " + state;
  }
  return difference;
}

std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, verdict_count> names{
      "same", "differs", "answered", "not recorded", "withdrawn", "unanswered"};
  return names.at(static_cast<std::size_t>(verdict));
}

const TimedAnswer* expected_of(const PlannedCall& call, Side side) {
  if (side == Side::program && call.settled) {
    return &*call.settled;
  }
  return call.answer ? &*call.answer : nullptr;
}

Judgement judge(const PlannedCall& call, const Outcome& outcome, Side side,
                const Tolerances* tolerances) {
  if (!outcome.answer) {
    return {call.withdrawn_after ? Verdict::withdrawn : Verdict::unanswered, std::nullopt};
  }
  if (tolerances == nullptr) {
    return {Verdict::answered, std::nullopt};
  }
  const TimedAnswer* const expected = expected_of(call, side);
  if (expected == nullptr) {
    return {Verdict::not_recorded, std::nullopt};
  }
  auto difference = compare(expected->answer, *outcome.answer, tolerances->of(call.uuid));
  return {difference ? Verdict::differs : Verdict::same, std::move(difference)};
}

}  // namespace millrace::tools::replay
