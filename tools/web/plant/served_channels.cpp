#include "tools/web/plant/served_channels.hpp"

#include <cmath>

#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

void ServedChannels::add(const fabric::InstanceId& instance, const fabric::ChannelKey& channel) {
  const Pair pair{instance, channel};
  if (now_.size() < most || now_.contains(pair)) {
    ++now_[pair];
  }
}

void ServedChannels::step() {
  ended_.push_back(std::exchange(now_, {}));
  if (ended_.size() > steps) {
    ended_.pop_front();
  }
}

boost::json::array ServedChannels::json(double step_seconds) const {
  std::map<Pair, std::uint32_t> sums;
  for (const auto& step : ended_) {
    for (const auto& [pair, calls] : step) {
      sums[pair] += calls;
    }
  }
  const double seconds = step_seconds * static_cast<double>(ended_.size());
  boost::json::array out;
  for (const auto& [pair, calls] : sums) {
    if (out.size() == most) {
      break;
    }
    // Three decimals are enough for a table, and short.
    out.push_back(
        boost::json::object{{"instance", pair.first.to_string()},
                            {"machine", print::utf8(pair.second.machine)},
                            {"channel", pair.second.channel},
                            {"calls_per_second", std::round(calls / seconds * 1000) / 1000}});
  }
  return out;
}

}  // namespace millrace::tools::web::plant
