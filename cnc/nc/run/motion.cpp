#include "cnc/nc/run/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "cnc/nc/values/conversion.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

constexpr double longest_seconds = 1e9;
constexpr double largest_position = 1e9;
// G functions that change nothing the simulation shows: planes, tool radius off, zero offsets,
// exact stop and path mode, feed per minute.
constexpr std::array<int, 15> ignored_g = {17, 18, 19, 40, 53, 54, 55, 56,
                                           57, 58, 59, 60, 64, 71, 94};

// Spindle, tool and correction have no effect on the simulated path.
constexpr std::array<std::string_view, 5> ignored_addresses = {"S", "@S", "T", "D", "H"};

bool is_ignored_address(std::string_view address) {
  return std::find(ignored_addresses.begin(), ignored_addresses.end(), address) !=
         ignored_addresses.end();
}

bool is_ignored(int number) {
  return std::find(ignored_g.begin(), ignored_g.end(), number) != ignored_g.end();
}

}  // namespace

double path_length(const std::vector<double>& from, const std::vector<double>& to) {
  double square = 0;
  for (std::size_t axis = 0; axis < from.size(); ++axis) {
    square += (to[axis] - from[axis]) * (to[axis] - from[axis]);
  }
  return std::sqrt(square);
}

// A block while its words are read.
struct MotionState::Draft {
  std::vector<std::pair<std::size_t, double>> axes;
  std::vector<int> functions;
  std::optional<double> dwell;
  bool is_dwell = false;
  bool hold = false;
  BlockEnd end = BlockEnd::none;
};

MotionState::MotionState(MotionOptions options)
    : options_(std::move(options)), position_(options_.axes.size()) {}

void MotionState::reset(const std::vector<double>& position) {
  position_ = position;
  rapid_ = true;
  incremental_ = false;
  feed_ = 0;
}

Duration MotionState::scaled(double seconds) const {
  const double limited = std::clamp(seconds * options_.time_scale, 0.0, longest_seconds);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(limited));
}

Result<void> MotionState::read_g(double number, Draft& draft) {
  switch (const int function = number == std::floor(number) && number >= 0 && number < 1000
                                   ? static_cast<int>(number)
                                   : -1) {
    case 0:
      rapid_ = true;
      return {};
    case 1:
      rapid_ = false;
      return {};
    case 4:
      draft.is_dwell = true;
      return {};
    case 90:
      incremental_ = false;
      return {};
    case 91:
      incremental_ = true;
      return {};
    default:
      if (is_ignored(function)) {
        return {};
      }
      return fault(20131, "unknown G function G" + values::display(number));
  }
}

Result<void> MotionState::read_m(double number, Draft& draft) const {
  if (number != std::floor(number) || number < 0 || number > 9999) {
    return fault(0, "M" + values::display(number) + " is no M function");
  }
  switch (const int function = static_cast<int>(number)) {
    case 0:
      draft.hold = true;
      return {};
    case 1:
      draft.hold = draft.hold || options_.optional_stop;
      return {};
    case 2:
    case 30:
      draft.end = BlockEnd::program;
      return {};
    case 17:
    case 29:
      draft.end = BlockEnd::subprogram;
      return {};
    default:
      draft.functions.push_back(function);
      return {};
  }
}

// @X, @Y and @Z are the channel's first three axes, whatever they are called.
std::size_t MotionState::find_axis(const std::string& address) const {
  const std::size_t count = options_.axes.size();
  if (address.size() == 2 && address.front() == '@' && address.back() >= 'X') {
    return std::min(static_cast<std::size_t>(address.back() - 'X'), count);
  }
  const auto axis = std::find(options_.axes.begin(), options_.axes.end(), address);
  return static_cast<std::size_t>(axis - options_.axes.begin());
}

Result<void> MotionState::read_axis(const WordValue& word, Draft& draft) const {
  const std::size_t axis = find_axis(word.address);
  if (axis == options_.axes.size()) {
    return fault(0, "the channel has no axis " + word.address);
  }
  if (!(std::abs(word.value) <= largest_position)) {
    return fault(0,
                 "the position " + word.address + values::display(word.value) + " is out of range");
  }
  draft.axes.emplace_back(axis, word.value);
  return {};
}

Result<void> MotionState::read_word(const WordValue& word, Draft& draft) {
  if (word.address == "G") {
    return read_g(word.value, draft);
  }
  if (word.address == "M") {
    return read_m(word.value, draft);
  }
  if (draft.is_dwell && (word.address.empty() || word.address == "X")) {
    draft.dwell = word.value;
    return {};
  }
  if (word.address == "F") {
    if (!(word.value > 0)) {
      return fault(0, "the feed F" + values::display(word.value) + " is not above zero");
    }
    feed_ = word.value;
    return {};
  }
  if (is_ignored_address(word.address)) {
    return {};
  }
  return read_axis(word, draft);
}

Result<void> MotionState::check_limits(const std::vector<double>& target) const {
  for (std::size_t axis = 0; axis < std::min(target.size(), options_.limits.size()); ++axis) {
    const auto& [least, greatest] = options_.limits[axis];
    if (!(target[axis] >= least && target[axis] <= greatest)) {
      return fault(0, "axis " + options_.axes[axis] + " would leave its limits, " +
                          values::display(least) + " to " + values::display(greatest) + ", for " +
                          values::display(target[axis]));
    }
  }
  return {};
}

Result<void> MotionState::move(const Draft& draft, Meaning& meaning) {
  std::vector<double> target = position_;
  for (const auto& [axis, value] : draft.axes) {
    target[axis] = incremental_ ? target[axis] + value : value;
  }
  if (auto inside = check_limits(target); !inside) {
    return inside;
  }
  if (!rapid_ && feed_ == 0) {
    return fault(0, "G01 without a feed; program F before it");
  }
  const double feed = rapid_ ? options_.rapid_feed : feed_;
  const double path = path_length(position_, target);
  meaning.actions.emplace_back(Motion{target, scaled(60.0 * path / feed)});
  position_ = std::move(target);
  return {};
}

Result<Meaning> MotionState::interpret(const std::vector<WordValue>& words) {
  Draft draft;
  for (const WordValue& word : words) {
    if (auto read = read_word(word, draft); !read) {
      return tl::make_unexpected(read.error());
    }
  }
  Meaning meaning;
  meaning.end = draft.end;
  for (const int function : draft.functions) {
    meaning.actions.emplace_back(MachineFunction{function});
  }
  if (draft.is_dwell) {
    if (!draft.dwell || !(*draft.dwell >= 0)) {
      return fault(0, "G04 needs a time in seconds: G04 X2.5 or G04 2.5");
    }
    meaning.actions.emplace_back(dwell(*draft.dwell));
  } else if (!draft.axes.empty()) {
    if (auto moved = move(draft, meaning); !moved) {
      return tl::make_unexpected(moved.error());
    }
  }
  if (draft.hold) {
    meaning.actions.emplace_back(Hold{});
  }
  return meaning;
}

}  // namespace millrace::cnc::nc::run
