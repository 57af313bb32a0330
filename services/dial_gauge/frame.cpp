#include "services/dial_gauge/frame.hpp"

#include <optional>
#include <utility>

#include "base/text/ascii.hpp"

namespace millrace::services::dial_gauge {

namespace {

using base::text::parse_number;

constexpr std::size_t max_frame = 64;

Frame value_or_broken(std::optional<unsigned> channel, std::optional<Nanometres> value,
                      std::string_view text) {
  if (!channel || !value) {
    return BrokenFrame{std::string(text)};
  }
  return ValueFrame{.channel = *channel, .value = *value};
}

Frame parse_u_wave(std::string_view text) {
  constexpr std::string_view value_start = "DT1";
  constexpr std::size_t channel_digits = 4;
  constexpr std::size_t value_size = 20;  // "DT10000+00000011.88M"
  if (text.starts_with("ST1") || text.starts_with("TI1")) {
    return StateFrame{};
  }
  const char unit = text.back();
  if (!text.starts_with(value_start) || text.size() != value_size || (unit != 'M' && unit != 'I')) {
    return BrokenFrame{std::string(text)};
  }
  const std::string_view rest =
      text.substr(value_start.size(), value_size - value_start.size() - 1);
  return value_or_broken(
      parse_number<unsigned>(rest.substr(0, channel_digits)),
      parse_length(rest.substr(channel_digits), unit == 'M' ? Unit::mm : Unit::inch), text);
}

Frame parse_digimatic(std::string_view text, Unit unit) {
  constexpr std::size_t value_size = 12;  // "01A+0000.123"
  if (text.size() == 3 && text[0] == '9' && parse_number<unsigned>(text.substr(1))) {
    return ErrorFrame{.channel = static_cast<unsigned>(text[1] - '0'), .code = text[2]};
  }
  if (text.size() != value_size || text[0] != '0' || text[2] != 'A') {
    return BrokenFrame{std::string(text)};
  }
  return value_or_broken(parse_number<unsigned>(text.substr(1, 1)),
                         parse_length(text.substr(3), unit), text);
}

}  // namespace

Frame parse_frame(std::string_view text, Form form, Unit digimatic_unit) {
  if (text.empty()) {
    return BrokenFrame{};
  }
  return form == Form::u_wave ? parse_u_wave(text) : parse_digimatic(text, digimatic_unit);
}

void FrameReader::feed(std::string_view bytes, const std::function<void(const Frame&)>& sink) {
  for (const char c : bytes) {
    if (c == '\r' || c == '\n') {
      end_frame(sink);
    } else if (!skipping_) {
      pending_ += c;
      if (pending_.size() == max_frame) {
        sink(BrokenFrame{std::exchange(pending_, {})});
        skipping_ = true;
      }
    }
  }
}

void FrameReader::end_frame(const std::function<void(const Frame&)>& sink) {
  skipping_ = false;
  if (!pending_.empty()) {
    sink(parse_frame(std::exchange(pending_, {}), form_, unit_));
  }
}

void FrameReader::reset() {
  pending_.clear();
  skipping_ = false;
}

}  // namespace millrace::services::dial_gauge
