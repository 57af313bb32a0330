#include "gateway/data/values.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace millrace::gateway::data {

namespace {

using cnc::variables::Element;
using fabric::Elements;
using fabric::Value;
using fabric::ValueType;

static_assert(static_cast<int>(ValueType::string) ==
              static_cast<int>(cnc::variables::Type::string));
static_assert(static_cast<int>(ValueType::boolean) ==
              static_cast<int>(cnc::variables::Type::boolean));

bool differs(double told, double now, double deadband) {
  if (std::isnan(told) || std::isnan(now)) {
    return std::isnan(told) != std::isnan(now);
  }
  // Infinite ones of one sign have no difference.
  return told != now && !(std::abs(now - told) <= deadband);
}

bool differs(std::int64_t told, std::int64_t now, double deadband) {
  return told != now && differs(static_cast<double>(told), static_cast<double>(now), deadband);
}

bool differs(const std::string& told, const std::string& now, double /*deadband*/) {
  return told != now;
}

bool differs(const Elements& told, const Elements& now, double deadband) {
  if (told.index() != now.index()) {
    return true;
  }
  return std::visit(
      [&](const auto& before) {
        const auto& after = std::get<std::decay_t<decltype(before)>>(now);
        return !std::ranges::equal(
            before, after, [&](const auto& a, const auto& b) { return !differs(a, b, deadband); });
      },
      told);
}

}  // namespace

ValueType type_of(const cnc::variables::Reading& reading) {
  return static_cast<ValueType>(reading.type.type);
}

tl::expected<Elements, std::string> elements_of(const cnc::variables::Reading& reading,
                                                cnc::variables::BytesView answer) {
  return cnc::variables::decode_elements(reading.type, answer)
      .map([&](std::vector<Element>&& decoded) -> Elements {
        if (reading.type.type == cnc::variables::Type::real64) {
          std::vector<double> reals;
          reals.reserve(decoded.size());
          for (const Element& one : decoded) {
            reals.push_back(std::get<double>(one));
          }
          return reals;
        }
        if (reading.type.type == cnc::variables::Type::string) {
          std::vector<std::string> texts;
          texts.reserve(decoded.size());
          for (Element& one : decoded) {
            texts.push_back(std::get<std::string>(std::move(one)));
          }
          return texts;
        }
        std::vector<std::int64_t> integers;
        integers.reserve(decoded.size());
        for (const Element& one : decoded) {
          const bool* const truth = std::get_if<bool>(&one);
          integers.push_back(truth != nullptr ? std::int64_t{*truth} : std::get<std::int64_t>(one));
        }
        return integers;
      });
}

bool is_news(const Value& told, const Value& now, double deadband) {
  return told.quality != now.quality || told.reason != now.reason || told.type != now.type ||
         told.is_array != now.is_array || differs(told.elements, now.elements, deadband);
}

}  // namespace millrace::gateway::data
