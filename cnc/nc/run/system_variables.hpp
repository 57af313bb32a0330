// The variables of the controller whose values the channel has itself; programs can only read them.
//
//   V.G.TIMER[n]           milliseconds at the last #TIMER READ
//   V.A.ABS.X, V.A.WCS.X   programmed position, up to the current block of the decoder
//   V.A.ACT_POS.X          position in the interpolator
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/nc/run/interpolator.hpp"
#include "cnc/nc/run/motion.hpp"
#include "cnc/nc/timers.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

class SystemVariables {
 public:
  /// The arguments must outlive this object.
  SystemVariables(const std::vector<std::string>& axes, const MotionState& motion,
                  const Interpolator& interpolator, const Timers& timers)
      : axes_(axes), motion_(motion), interpolator_(interpolator), timers_(timers) {}

  /// Nullopt for any other variable.
  [[nodiscard]] std::optional<double> read(std::string_view name) const;

 private:
  [[nodiscard]] std::optional<double> position(const std::vector<double>& positions,
                                               std::string_view axis) const;

  const std::vector<std::string>& axes_;
  const MotionState& motion_;
  const Interpolator& interpolator_;
  const Timers& timers_;
};

}  // namespace millrace::cnc::nc::run
