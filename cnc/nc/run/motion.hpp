// From the words of a block to what the interpolator executes: G functions, axes, feed, M
// functions.
#pragma once

#include <string>
#include <vector>

#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/block.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// A word with its value computed.
struct WordValue {
  std::string address;
  double value = 0;
};

/// How the words of a block end the program or the subprogram.
enum class BlockEnd { none, subprogram, program };

/// What a block means.
struct Meaning {
  std::vector<Block::Action> actions;
  BlockEnd end = BlockEnd::none;
};

struct MotionOptions {
  std::vector<std::string> axes;
  /// In the order of the axes; axes beyond these go anywhere.
  std::vector<AxisLimits> limits;
  /// mm/min
  double rapid_feed = 0;
  double time_scale = 1;
  bool optional_stop = false;
};

/// Along a straight line between two positions of all axes.
[[nodiscard]] double path_length(const std::vector<double>& from, const std::vector<double>& to);

/// What G and F functions leave behind for the blocks that follow, and the programmed position.
class MotionState {
 public:
  explicit MotionState(MotionOptions options);

  /// A program starts with the axes here.
  void reset(const std::vector<double>& position);
  /// Fault for an unknown word, an axis the channel does not have, a feed missing.
  values::Result<Meaning> interpret(const std::vector<WordValue>& words);
  /// A pause, in the channel's time scale.
  [[nodiscard]] Dwell dwell(double seconds) const { return {scaled(seconds)}; }
  /// Programmed position of the axes, as far as the decoder has got.
  [[nodiscard]] const std::vector<double>& position() const { return position_; }

 private:
  struct Draft;
  values::Result<void> read_word(const WordValue& word, Draft& draft);
  values::Result<void> read_g(double number, Draft& draft);
  values::Result<void> read_m(double number, Draft& draft) const;
  values::Result<void> read_axis(const WordValue& word, Draft& draft) const;
  /// Index of an axis, or the number of axes if the channel does not have it.
  [[nodiscard]] std::size_t find_axis(const std::string& address) const;
  values::Result<void> move(const Draft& draft, Meaning& meaning);
  [[nodiscard]] values::Result<void> check_limits(const std::vector<double>& target) const;
  [[nodiscard]] Duration scaled(double seconds) const;

  MotionOptions options_;
  std::vector<double> position_;
  bool rapid_ = true;
  bool incremental_ = false;
  /// mm/min; 0 = none programmed yet.
  double feed_ = 0;
};

}  // namespace millrace::cnc::nc::run
