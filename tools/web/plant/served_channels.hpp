// Which instance has answered the calls of which channel in the last minute. Pure.
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
  /// Of so many pairs there are figures.
  static constexpr std::size_t most = 4'000;

  void add(const fabric::InstanceId& instance, const fabric::ChannelKey& channel);
  void step();

  /// `step_seconds` is how long a step is. Per second of the steps that have ended, so that who has
  /// just begun does not seem busier than he is.
  [[nodiscard]] boost::json::array json(double step_seconds) const;

 private:
  using Pair = std::pair<fabric::InstanceId, fabric::ChannelKey>;
  /// One for each step.
  std::map<Pair, std::uint32_t> now_;
  std::deque<std::map<Pair, std::uint32_t>> ended_;
};

}  // namespace millrace::tools::web::plant
