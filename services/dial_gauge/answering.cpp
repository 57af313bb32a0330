#include "services/dial_gauge/answering.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "fabric/messages.hpp"
#include "services/text/answer.hpp"
#include "services/text/fields.hpp"

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
  if (!text::is_name(words[1])) {
    return tl::unexpected("no gauge can be called " + text::in_quotes(words[1]));
  }
  return Request{.verb = *verb, .gauge = std::string(words[1]), .bare = bare};
}

namespace {

using sdk::Response;
using text::error;

std::uint32_t state_of(Fault fault) {
  switch (fault) {
    case Fault::no_contact:
      return state_no_contact;
    case Fault::battery_low:
      return state_battery_low;
    case Fault::line_down:
      return state_line_down;
  }
  return state_no_contact;
}

std::string words_of(Fault fault) {
  switch (fault) {
    case Fault::no_contact:
      return "no radio contact";
    case Fault::battery_low:
      return "battery low";
    case Fault::line_down:
      return "receiver not reachable";
  }
  return {};
}

double seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

void Answering::add(Gauge gauge, std::unique_ptr<Source> source) {
  assert(source != nullptr && text::is_name(gauge.name));
  const std::string name = gauge.name;
  gauges_.insert_or_assign(name, Entry{.gauge = std::move(gauge), .source = std::move(source)});
}

tl::expected<Reading, Failure> Answering::read_source(Entry& entry, Time now) {
  auto reading = entry.source->read(now);
  if (reading) {
    failing_.erase(entry.gauge.name);
  } else {
    const Failure& failure = reading.error();
    failing_.insert_or_assign(entry.gauge.name, fmt::format("{} of {}: {}", words_of(failure.fault),
                                                            entry.gauge.name, failure.reason));
  }
  return reading;
}

tl::expected<Reading, Response> Answering::good_reading(Entry& entry, Time now) {
  const Gauge& gauge = entry.gauge;
  const auto reading = read_source(entry, now);
  if (!reading) {
    return tl::unexpected(error(state_of(reading.error().fault), failing_.at(gauge.name)));
  }
  const auto age = now - reading->taken;
  if (age > gauge.max_age) {
    return tl::unexpected(
        error(state_too_old, fmt::format("value of {} is {:.1f} s old, at most {:.1f} s",
                                         gauge.name, seconds(age), seconds(gauge.max_age))));
  }
  if (reading->value < gauge.minimum || reading->value > gauge.maximum) {
    return tl::unexpected(error(
        state_out_of_range,
        fmt::format("{} shows {}, range {} to {}", gauge.name,
                    to_text(reading->value, gauge.decimals), to_text(gauge.minimum, gauge.decimals),
                    to_text(gauge.maximum, gauge.decimals))));
  }
  return *reading;
}

void Answering::look() {
  std::erase_if(failing_, [this](const auto& each) {
    return gauges_.find(each.first)->second.source->has_reading();
  });
}

Response Answering::answer(std::string_view text, Time now) {
  const auto request = parse(text);
  if (!request) {
    return error(text::state_bad_request, request.error());
  }
  if (request->verb == Verb::list) {
    return list();
  }
  const auto found = gauges_.find(request->gauge);
  if (found == gauges_.end()) {
    return unknown(request->gauge);
  }
  switch (request->verb) {
    case Verb::zero:
      return zero(found->second, now);
    case Verb::status:
      return status(found->second, now);
    default:
      return read(found->second, request->bare, now);
  }
}

Response Answering::unknown(const std::string& name) const {
  return error(state_unknown_gauge,
               "no gauge " + text::in_quotes(name) + "; there is " + list().text);
}

Response Answering::list() const {
  constexpr std::size_t room_for_count = 12;  // " +65535 more"
  std::string names;
  std::size_t left = gauges_.size();
  for (const auto& [name, entry] : gauges_) {
    if (names.size() + 1 + name.size() + room_for_count > fabric::max_text) {
      return {.text = fmt::format("{} +{} more", names, left)};
    }
    names += (names.empty() ? "" : " ") + name;
    --left;
  }
  return {.text = names.empty() ? "none" : names};
}

Response Answering::read(Entry& entry, bool bare, Time now) {
  const auto reading = good_reading(entry, now);
  if (!reading) {
    return reading.error();
  }
  std::string text = to_text(reading->value - zero_of(entry.gauge.name), entry.gauge.decimals);
  if (bare) {
    text.resize(text.find(' '));
  }
  return {.text = std::move(text)};
}

Response Answering::zero(Entry& entry, Time now) {
  const auto reading = good_reading(entry, now);
  if (!reading) {
    return reading.error();
  }
  Zeros zeros = zeros_;
  zeros[entry.gauge.name] = reading->value;
  if (const auto kept = keep_(zeros); !kept) {
    return error(state_zero_not_kept, "zero point not set: " + kept.error());
  }
  zeros_ = std::move(zeros);
  return {.text = to_text(0, entry.gauge.decimals)};
}

Response Answering::status(Entry& entry, Time now) {
  const auto reading = good_reading(entry, now);
  if (!reading) {
    return reading.error();
  }
  const Condition condition = entry.source->condition();
  const std::string battery = condition.battery_percent
                                  ? fmt::format("{} %", *condition.battery_percent)
                                  : std::string("unknown");
  return {.text = fmt::format("OK age {:.1f} s, battery {}, zero at {}, {} readings, {} failures",
                              seconds(now - reading->taken), battery,
                              to_text(zero_of(entry.gauge.name), entry.gauge.decimals),
                              condition.readings, condition.failures)};
}

Nanometres Answering::zero_of(const std::string& gauge) const {
  const auto found = zeros_.find(gauge);
  return found == zeros_.end() ? 0 : found->second;
}

}  // namespace millrace::services::dial_gauge
