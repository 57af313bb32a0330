#include "gateway/data/group.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace millrace::gateway::data {

using fabric::DataSample;
using fabric::Quality;

void CycleTime::start(SteadyTime now) {
  counting_since_ = now;
  counted_ = 0;
}

void CycleTime::stop() {
  period_ = wanted_;
  changed_ = false;
}

/// Over ten cycles, and at least five seconds: one that is late now and then is not news.
void CycleTime::count(SteadyTime now) {
  constexpr std::chrono::seconds at_least{5};
  constexpr std::uint32_t beats = 10;
  ++counted_;
  const auto passed = now - counting_since_;
  if (passed < at_least || passed < beats * wanted_) {
    return;
  }
  const auto cost = std::chrono::nanoseconds(passed) / counted_;
  // It counts as slow from a fifth on, until it is within a tenth again.
  const std::chrono::nanoseconds wanted = wanted_;
  const bool was_slow = slow();
  const bool is_slow = was_slow ? cost > wanted + wanted / 10 : cost > wanted + wanted / 5;
  changed_ = changed_ || is_slow != was_slow;
  period_ = is_slow ? cost : wanted;
  start(now);
}

Group::Group(GroupSettings settings, std::string machine)
    : settings_(std::move(settings)), machine_(std::move(machine)), cycle_time_(settings_.period) {
  for (const std::string& name : settings_.names) {
    items_.push_back({.value = {.name = name, .quality = Quality::stale}});
  }
}

void Group::start(SteadyTime now) {
  started_ = true;
  due_ = now;
  cycle_time_.start(now);
  for (Item& item : items_) {
    item.reading.reset();
    item.resolve_at = now;
  }
}

std::optional<DataSample> Group::stop(const fabric::Message& reason, Moment now) {
  started_ = false;
  cycle_.reset();
  cycle_time_.stop();
  for (Item& item : items_) {
    item.value.quality = Quality::stale;
    item.value.reason = reason;
  }
  if (published_.empty()) {
    return std::nullopt;
  }
  DataSample last = sample(now);
  published_ = last.values;
  return last;
}

void Group::begin_cycle() {
  cycle_ = Cycle{};  // Clang 16 has no emplace() of a nested class with default initialisers.
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (items_[i].reading) {
      cycle_->pending.insert(cycle_->pending.end(), i);
    }
  }
}

void Group::asked(std::size_t item) {
  cycle_->pending.erase(item);
  ++cycle_->under_way;
}

std::optional<DataSample> Group::end_cycle(Moment now) {
  cycle_.reset();
  const auto behind = now.steady - due_;
  due_ += (behind / settings_.period + 1) * settings_.period;
  cycle_time_.count(now.steady);
  bool news = settings_.always || cycle_time_.changed() || published_.empty();
  for (std::size_t i = 0; i < published_.size() && !news; ++i) {
    news = is_news(published_[i], items_[i].value, settings_.deadband);
  }
  if (!news) {
    return std::nullopt;
  }
  DataSample next = sample(now);
  published_ = next.values;
  return next;
}

DataSample Group::sample(Moment now) const {
  DataSample sample{.key = {machine_, settings_.channel},
                    .group = settings_.name,
                    .at = now.wall,
                    .period = cycle_time_.period(),
                    .wanted = settings_.period};
  for (const Item& item : items_) {
    sample.values.push_back(item.value);
  }
  return sample;
}

namespace {

using cnc::variables::Element;
using fabric::Elements;
using fabric::Value;
using fabric::ValueType;

static_assert(static_cast<int>(ValueType::string) ==
              static_cast<int>(cnc::variables::Type::string));
static_assert(static_cast<int>(ValueType::boolean) ==
              static_cast<int>(cnc::variables::Type::boolean));

bool differs(double last, double now, double deadband) {
  if (std::isnan(last) || std::isnan(now)) {
    return std::isnan(last) != std::isnan(now);
  }
  // Infinite ones of one sign have no difference.
  return last != now && !(std::abs(now - last) <= deadband);
}

bool differs(std::int64_t last, std::int64_t now, double deadband) {
  return last != now && differs(static_cast<double>(last), static_cast<double>(now), deadband);
}

bool differs(const std::string& last, const std::string& now, double /*deadband*/) {
  return last != now;
}

bool differs(const Elements& last, const Elements& now, double deadband) {
  if (last.index() != now.index()) {
    return true;
  }
  return std::visit(
      [&](const auto& before) {
        const auto& after = std::get<std::decay_t<decltype(before)>>(now);
        return !std::ranges::equal(
            before, after, [&](const auto& a, const auto& b) { return !differs(a, b, deadband); });
      },
      last);
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
          for (const Element& element : decoded) {
            reals.push_back(std::get<double>(element));
          }
          return reals;
        }
        if (reading.type.type == cnc::variables::Type::string) {
          std::vector<std::string> texts;
          texts.reserve(decoded.size());
          for (Element& element : decoded) {
            texts.push_back(std::get<std::string>(std::move(element)));
          }
          return texts;
        }
        std::vector<std::int64_t> integers;
        integers.reserve(decoded.size());
        for (const Element& element : decoded) {
          const bool* const truth = std::get_if<bool>(&element);
          integers.push_back(truth != nullptr ? std::int64_t{*truth}
                                              : std::get<std::int64_t>(element));
        }
        return integers;
      });
}

bool is_news(const Value& last, const Value& now, double deadband) {
  return last.quality != now.quality || last.reason != now.reason || last.type != now.type ||
         last.is_array != now.is_array || differs(last.elements, now.elements, deadband);
}

}  // namespace millrace::gateway::data
