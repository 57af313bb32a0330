// Calls, errors, durations and load of the last half hour, in steps, for lines over time. Pure.
//
//   history.add_call(uuid, instance, channel, duration, failed);
//   history.step(running);                              // every `step_length`
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/messages.hpp"

namespace millrace::tools::web::plant {

// Which instances answered the calls of which channels in the last minute. Pure.
//
//   served.add(instance, channel);
//   served.step();                                      // every History::step_length
//   served.json()                                       // [{instance, machine, channel, calls_per_second}]

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

class History {
 public:
  static constexpr std::chrono::seconds step_length{5};
  static constexpr std::size_t most_steps = 360;
  /// Limit for the lines of services and instances: an instance that crashes at each start adds one
  /// each time.
  static constexpr std::size_t most_lines = 1'000;

  void add_call(const std::string& uuid, const fabric::InstanceId& instance,
                const fabric::ChannelKey& channel, std::optional<std::chrono::nanoseconds> duration,
                bool failed);
  /// Ends a step at `now`. `running`: the number of calls of each instance. An instance that is not
  /// in it is gone; its line is dropped when none of its points remain.
  void step(fabric::Time now, const std::map<fabric::InstanceId, std::uint32_t>& running);

  /// {step_ms, end, totals, services, instances, served}.
  [[nodiscard]] boost::json::object json() const;

 private:
  struct Point {
    float per_second = 0;
    float errors_per_second = 0;
    /// Milliseconds; negative = none.
    float p50 = -1;
    float p99 = -1;
    std::int32_t running = -1;
  };
  struct Line {
    std::vector<std::chrono::nanoseconds> durations{};
    std::uint32_t calls = 0;
    std::uint32_t errors = 0;
    std::deque<Point> points{};

    void add(std::optional<std::chrono::nanoseconds> duration, bool failed);
    void step(std::optional<std::uint32_t> running);
    /// All of its points are empty.
    [[nodiscard]] bool is_empty() const;
    [[nodiscard]] boost::json::object json() const;
  };

  template <typename Lines>
  static void drop_empty(Lines& lines);

  Line totals_;
  std::map<std::string, Line> services_;
  std::map<fabric::InstanceId, Line> instances_;
  ServedChannels served_;
  fabric::Time end_{};
};

}  // namespace millrace::tools::web::plant
