#include "tools/web/plant/history.hpp"

#include <algorithm>
#include <cmath>

#include "tools/print/json.hpp"
#include "tools/web/plant/throughput.hpp"

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

namespace {

/// More durations do not improve a percentile.
constexpr std::size_t most_durations = 8'192;

/// In ms; -1 without values.
float share_of(std::vector<std::chrono::nanoseconds>& values, double share) {
  return values.empty()
             ? -1
             : std::chrono::duration<float, std::milli>(percentile(values, share)).count();
}

boost::json::value rounded(float value) {
  if (value < 0) {
    return nullptr;
  }
  // Three decimals are enough for a line, and short.
  return static_cast<double>(std::lround(value * 1000.0F)) / 1000.0;
}

}  // namespace

void History::Line::add(std::optional<std::chrono::nanoseconds> duration, bool failed) {
  ++calls;
  errors += failed ? 1U : 0U;
  if (duration && durations.size() < most_durations) {
    durations.push_back(*duration);
  }
}

void History::Line::step(std::optional<std::uint32_t> running) {
  constexpr auto seconds = static_cast<float>(step_length.count());
  Point point{.per_second = static_cast<float>(calls) / seconds,
              .errors_per_second = static_cast<float>(errors) / seconds};
  point.p50 = share_of(durations, 0.5);
  point.p99 = share_of(durations, 0.99);
  point.running = running ? static_cast<std::int32_t>(*running) : -1;
  points.push_back(point);
  if (points.size() > most_steps) {
    points.pop_front();
  }
  durations.clear();
  calls = 0;
  errors = 0;
}

bool History::Line::is_empty() const {
  return std::ranges::all_of(
      points, [](const Point& point) { return point.per_second == 0 && point.running < 0; });
}

boost::json::object History::Line::json() const {
  boost::json::array per_second;
  boost::json::array errors_per_second;
  boost::json::array p50;
  boost::json::array p99;
  boost::json::array running;
  for (const Point& point : points) {
    per_second.push_back(rounded(point.per_second));
    errors_per_second.push_back(rounded(point.errors_per_second));
    p50.push_back(rounded(point.p50));
    p99.push_back(rounded(point.p99));
    running.push_back(point.running < 0 ? boost::json::value(nullptr)
                                        : boost::json::value(point.running));
  }
  return {{"calls_per_second", std::move(per_second)},
          {"errors_per_second", std::move(errors_per_second)},
          {"p50_ms", std::move(p50)},
          {"p99_ms", std::move(p99)},
          {"running", std::move(running)}};
}

void History::add_call(const std::string& uuid, const fabric::InstanceId& instance,
                       const fabric::ChannelKey& channel,
                       std::optional<std::chrono::nanoseconds> duration, bool failed) {
  totals_.add(duration, failed);
  if (services_.size() < most_lines || services_.contains(uuid)) {
    services_[uuid].add(duration, failed);
  }
  if (instance == fabric::InstanceId{}) {
    return;
  }
  served_.add(instance, channel);
  if (instances_.size() < most_lines || instances_.contains(instance)) {
    instances_[instance].add(duration, failed);
  }
}

template <typename Lines>
void History::drop_empty(Lines& lines) {
  std::erase_if(lines, [](const auto& line) { return line.second.is_empty(); });
}

void History::step(fabric::Time now, const std::map<fabric::InstanceId, std::uint32_t>& running) {
  end_ = now;
  std::uint32_t all = 0;
  for (const auto& [instance, calls] : running) {
    all += calls;
    if (instances_.size() < most_lines) {
      instances_.try_emplace(instance);
    }
  }
  totals_.step(all);
  for (auto& [uuid, line] : services_) {
    line.step(std::nullopt);
  }
  for (auto& [instance, line] : instances_) {
    const auto busy = running.find(instance);
    line.step(busy == running.end() ? std::nullopt : std::optional(busy->second));
  }
  drop_empty(services_);
  drop_empty(instances_);
  served_.step();
}

boost::json::object History::json() const {
  boost::json::object services;
  for (const auto& [uuid, line] : services_) {
    services[print::utf8(uuid)] = line.json();
  }
  boost::json::object instances;
  for (const auto& [instance, line] : instances_) {
    instances[instance.to_string()] = line.json();
  }
  boost::json::object out{
      {"step_ms", std::chrono::milliseconds(step_length).count()},
      {"totals", totals_.json()},
      {"services", std::move(services)},
      {"instances", std::move(instances)},
      {"served", served_.json(std::chrono::duration<double>(step_length).count())}};
  print::put_time(out, "end", end_);
  return out;
}

}  // namespace millrace::tools::web::plant
