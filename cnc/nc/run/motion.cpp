// Reads the words of a block; motion_path.cpp computes the motion of the axes.
#include "cnc/nc/run/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/manual.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

constexpr double longest_seconds = 1e9;
constexpr double largest_position = 1e9;
// G functions without an effect on the simulation: tool radius off, zero offsets, exact stop and
// path mode, feed per minute.
constexpr std::array<int, 12> ignored_g = {40, 53, 54, 55, 56, 57, 58, 59, 60, 64, 71, 94};

// Spindles (S, S2), tool, correction, H functions and the feed at the block's end have no effect on
// the simulated path.
bool is_ignored_address(std::string_view address) {
  constexpr std::string_view ignored = "STDHE";
  return address == "@S" ||
         (!address.empty() && ignored.find(address.front()) != std::string_view::npos &&
          std::all_of(address.begin() + 1, address.end(), is_digit));
}

bool is_ignored(int number) {
  return std::find(ignored_g.begin(), ignored_g.end(), number) != ignored_g.end();
}

}  // namespace

MotionState::MotionState(MotionOptions options)
    : options_(std::move(options)), position_(options_.axes.size()) {}

void MotionState::reset(const std::vector<double>& position) {
  position_ = position;
  way_ = Way::rapid;
  plane_ = Plane::xy;
  incremental_ = false;
  absolute_centre_ = false;
  corrected_centre_ = true;
  radius_.reset();
  feed_ = 0;
}

Duration MotionState::scaled(double seconds) const {
  const double limited = std::clamp(seconds * options_.time_scale, 0.0, longest_seconds);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(limited));
}

bool MotionState::read_modal_g(int function) {
  switch (function) {
    case 0:
      way_ = Way::rapid;
      return true;
    case 1:
      way_ = Way::line;
      return true;
    case 2:
      way_ = Way::clockwise;
      return true;
    case 3:
      way_ = Way::counterclockwise;
      return true;
    case 17:
      plane_ = Plane::xy;
      return true;
    case 18:
      plane_ = Plane::zx;
      return true;
    case 19:
      plane_ = Plane::yz;
      return true;
    case 90:
    case 91:
      incremental_ = function == 91;
      return true;
    case 161:
    case 162:
      absolute_centre_ = function == 161;
      return true;
    case 164:
    case 165:
      corrected_centre_ = function == 165;
      return true;
    default:
      return false;
  }
}

void MotionState::read_g(double number, Draft& draft) {
  const int function =
      number == std::floor(number) && number >= 0 && number < 1000 ? static_cast<int>(number) : -1;
  if (function == 4) {
    draft.is_dwell = true;
  } else if (read_modal_g(function) || is_ignored(function)) {
    return;
  } else if (syntax::is_listed_g(function) && !syntax::calls_subprogram(function)) {
    draft.has_values = draft.has_values || syntax::takes_values(function);
    draft.skipped.push_back(function);
  } else {
    fail(20131, "unknown G function G" + values::display(number));
  }
}

void MotionState::read_m(const WordValue& word, Draft& draft) const {
  const double number = std::round(word.value);
  if (!(number >= 0 && number <= 9999)) {
    fail(0, "M" + values::display(word.value) + " is not an M function");
  }
  switch (const int function = static_cast<int>(number)) {
    case 0:
      draft.hold = true;
      break;
    case 1:
      draft.hold = draft.hold || options_.optional_stop;
      break;
    case 2:
    case 30:
      draft.end = BlockEnd::program;
      break;
    case 17:
    case 29:
      draft.end = BlockEnd::subprogram;
      break;
    default:
      draft.functions.push_back({function, word.argument});
      break;
  }
}

// @X, @Y and @Z are the channel's first three axes, whatever their names.
std::size_t MotionState::find_axis(const std::string& address) const {
  const std::size_t count = options_.axes.size();
  if (address.size() == 2 && address.front() == '@' && address.back() >= 'X') {
    return std::min(static_cast<std::size_t>(address.back() - 'X'), count);
  }
  const auto axis = std::find(options_.axes.begin(), options_.axes.end(), address);
  return static_cast<std::size_t>(axis - options_.axes.begin());
}

void MotionState::read_axis(const WordValue& word, Draft& draft) const {
  const std::size_t axis = find_axis(word.address);
  if (axis == options_.axes.size()) {
    fail(0, "the channel has no axis " + word.address);
  }
  if (!(std::abs(word.value) <= largest_position)) {
    fail(0, "the position " + word.address + values::display(word.value) + " is out of range");
  }
  draft.axes.emplace_back(axis, word.value);
}

void MotionState::read_feed(double feed) {
  if (!(feed > 0)) {
    fail(0, "the feed F" + values::display(feed) + " is not above zero");
  }
  feed_ = feed;
}

bool MotionState::read_circle_word(const WordValue& word, Draft& draft) {
  if (find_axis(word.address) != options_.axes.size()) {
    return false;
  }
  const char letter = word.address.empty() ? '\0' : word.address.back();
  const bool of_cycle = word.address.size() == 2 && word.address.front() == '@';
  if ((word.address.size() == 1 || of_cycle) && letter >= 'I' && letter <= 'K') {
    draft.centre.at(static_cast<std::size_t>(letter - 'I')) = word.value;
    return true;
  }
  if (word.address == "R" || word.address == "R1") {
    radius_ = word.value;
    draft.has_radius = true;
    return true;
  }
  if (word.address.starts_with('R')) {
    fail(20188, "the only radius with a number is R1, not " + word.address);
  }
  return false;
}

void MotionState::read_word(const WordValue& word, Draft& draft) {
  if (word.address == "G") {
    return;
  }
  if (word.address == "M") {
    read_m(word, draft);
  } else if (draft.is_dwell && (word.address.empty() || word.address == "X")) {
    draft.dwell = word.value;
  } else if (draft.has_values && word.address != "F") {
    return;
  } else if (word.address == "F") {
    read_feed(word.value);
  } else if (!is_ignored_address(word.address) && !read_circle_word(word, draft)) {
    read_axis(word, draft);
  }
}

Meaning MotionState::interpret(const std::vector<WordValue>& words) {
  Draft draft;
  // They decide what the other words of their block mean.
  for (const WordValue& word : words) {
    if (word.address == "G") {
      read_g(word.value, draft);
    }
  }
  for (const WordValue& word : words) {
    read_word(word, draft);
  }
  Meaning meaning;
  meaning.end = draft.end;
  meaning.skipped = std::move(draft.skipped);
  for (const MachineFunction& function : draft.functions) {
    meaning.actions.emplace_back(function);
  }
  if (draft.is_dwell) {
    if (!draft.dwell || !(*draft.dwell >= 0)) {
      fail(0, "G04 needs a time in seconds: G04 X2.5 or G04 2.5");
    }
    meaning.actions.emplace_back(dwell(*draft.dwell));
  } else if (const bool circle = way_ == Way::clockwise || way_ == Way::counterclockwise;
             draft.has_centre() && !circle && meaning.skipped.empty()) {
    fail(0, "I, J and K are the centre of a circle, for which G02 or G03 is needed");
  } else if (!draft.axes.empty() || (draft.has_centre() && circle)) {
    move(draft, meaning);
  }
  if (draft.hold) {
    meaning.actions.emplace_back(Hold{});
  }
  return meaning;
}

}  // namespace millrace::cnc::nc::run
