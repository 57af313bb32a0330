// Converts the words of a block to actions of the interpolator: G functions, axes, feed, M
// functions.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/block.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// A word with its computed value.
struct WordValue {
  std::string address;
  double value = 0;
  /// M52=-345
  std::optional<double> argument{};
};

/// Whether the words of a block end the program or the subprogram.
enum class BlockEnd { none, subprogram, program };

/// The meaning of a block.
struct Meaning {
  std::vector<Block::Action> actions;
  BlockEnd end = BlockEnd::none;
  /// Documented G functions without an effect here.
  std::vector<int> skipped;
};

struct MotionOptions {
  std::vector<std::string> axes;
  /// In the order of the axes; axes without an entry are unlimited.
  std::vector<AxisLimits> limits;
  /// mm/min
  double rapid_feed = 0;
  double time_scale = 1;
  bool optional_stop = false;
};

/// Length of the straight line between two positions of all axes.
[[nodiscard]] double path_length(const std::vector<double>& from, const std::vector<double>& to);

/// The modal state of G and F functions for the following blocks, and the programmed position.
class MotionState {
 public:
  explicit MotionState(MotionOptions options);

  /// A program starts at this position of the axes.
  void reset(const std::vector<double>& position);
  /// M01 stops from the next block on.
  void set_optional_stop(bool on) { options_.optional_stop = on; }
  /// Aborts the program (values::Aborted) for an unknown word, an axis that the channel does not
  /// have, a missing feed, or an impossible circle (circle.hpp).
  Meaning interpret(const std::vector<WordValue>& words);
  /// A pause, in the channel's time scale.
  [[nodiscard]] Dwell dwell(double seconds) const { return {scaled(seconds)}; }
  /// Programmed position of the axes, up to the current block of the decoder.
  [[nodiscard]] const std::vector<double>& position() const { return position_; }

 private:
  /// G00, G01, G02, G03.
  enum class Way { rapid, line, clockwise, counterclockwise };
  struct Draft;

  // motion.cpp
  void read_word(const WordValue& word, Draft& draft);
  void read_g(double number, Draft& draft);
  /// False if the function is not modal.
  bool read_modal_g(int function);
  void read_m(const WordValue& word, Draft& draft) const;
  void read_feed(double feed);
  void read_axis(const WordValue& word, Draft& draft) const;
  /// I, J, K and R, unless the channel has an axis of that name; false for any other word.
  bool read_circle_word(const WordValue& word, Draft& draft);
  /// Index of an axis, or the number of axes if the channel does not have it.
  [[nodiscard]] std::size_t find_axis(const std::string& address) const;
  [[nodiscard]] Duration scaled(double seconds) const;
  // motion_path.cpp
  void move(const Draft& draft, Meaning& meaning);
  [[nodiscard]] std::optional<Arc> arc_to(const std::vector<double>& target,
                                          const Draft& draft) const;
  /// The time in minutes that the slowest axis needs for the motion to a target, along an arc if
  /// there is one.
  [[nodiscard]] double least_time(const std::vector<double>& target,
                                  const std::optional<Arc>& arc) const;
  void check_limits(const std::vector<double>& target) const;
  void check_limits(const std::vector<double>& target, const Arc& arc) const;

  MotionOptions options_;
  std::vector<double> position_;
  Way way_ = Way::rapid;
  Plane plane_ = Plane::xy;
  bool incremental_ = false;
  /// G161: I, J and K are coordinates; G162: from the beginning of the circle.
  bool absolute_centre_ = false;
  /// G165
  bool corrected_centre_ = true;
  /// R, which also applies to the following circles.
  std::optional<double> radius_;
  /// mm/min; 0 = none programmed yet.
  double feed_ = 0;
};

// A block of words while it is read; only for motion*.cpp.

struct MotionState::Draft {
  std::vector<std::pair<std::size_t, double>> axes;
  std::vector<MachineFunction> functions;
  std::vector<int> skipped;
  std::optional<double> dwell;
  /// I, J and K.
  std::array<std::optional<double>, 3> centre;
  bool has_radius = false;
  bool is_dwell = false;
  /// Its axis words are values, not positions.
  bool has_values = false;
  bool hold = false;
  BlockEnd end = BlockEnd::none;

  [[nodiscard]] bool has_centre() const { return centre[0] || centre[1] || centre[2]; }
};

}  // namespace millrace::cnc::nc::run
