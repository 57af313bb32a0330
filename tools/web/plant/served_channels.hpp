// Which instances answered the calls of which channels in the last minute. Pure.
//
//   served.add(instance, channel);
//   served.step();                                      // every History::step_length
//   served.json()                                       // [{instance, machine, channel, calls_per_second}]
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>

#include <boost/json/array.hpp>

#include "fabric/messages.hpp"

namespace millrace::tools::web::plant {

class ServedChannels {
 public:
  static constexpr std::size_t steps = 12;
  /// Pairs of instance and channel; calls of further pairs are not counted.
  static constexpr std::size_t most = 4'000;

  void add(const fabric::InstanceId& instance, const fabric::ChannelKey& channel);
  void step();

  /// Calls per second over the steps that have ended, so a short first step does not inflate the
  /// rate. `step_seconds`: length of a step.
  [[nodiscard]] boost::json::array json(double step_seconds) const;

 private:
  using Pair = std::pair<fabric::InstanceId, fabric::ChannelKey>;
  /// Calls of the current step, and of each ended one.
  std::map<Pair, std::uint32_t> now_;
  std::deque<std::map<Pair, std::uint32_t>> ended_;
};

}  // namespace millrace::tools::web::plant
