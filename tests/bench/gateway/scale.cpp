#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/bench/gateway/scale_plant.hpp"

namespace millrace::bench {

namespace {

/// The limit for a row, in case a process hangs.
constexpr std::chrono::seconds limit_of_row{300};

struct Dimension {
  const char* name;
  /// What stays constant.
  const char* beside;
  std::vector<std::uint32_t> sizes;
  PlantSize (*plant)(std::uint32_t size);
};

const std::vector<Dimension>& all() {
  static const std::vector<Dimension> dimensions{
      {"instances",
       "processes of one UUID; 1 gateway, 64 channels",
       {1, 4, 16, 64, 100, 200},
       [](std::uint32_t n) { return PlantSize{.instances = n, .processes = n}; }},
      {"uuids",
       "an instance each, in one process; 1 gateway, 64 channels",
       {1, 10, 100, 1000},
       [](std::uint32_t n) { return PlantSize{.instances = n, .processes = 1, .uuids = n}; }},
      {"channels",
       "of one machine, each with a call; 1 gateway, 4 instances",
       {1, 16, 64, 256, 1000},
       [](std::uint32_t n) { return PlantSize{.channels = n}; }},
      {"machines",
       "of 4 channels, each with a call; 1 gateway, 4 instances",
       {1, 4, 16, 64, 250},
       [](std::uint32_t n) { return PlantSize{.machines = n, .channels = 4}; }},
      {"gateways",
       "of 16 channels, each with a call; they share 4 instances",
       {1, 2, 4, 8, 16},
       [](std::uint32_t n) { return PlantSize{.gateways = n, .channels = 16}; }},
      {"observers",
       "processes of millrace record; 1 gateway, 64 channels, 4 instances",
       {0, 1, 2, 4, 8},
       [](std::uint32_t n) { return PlantSize{.observers = n}; }},
      {"hosts",
       "that share 16 instances, and one of the gateway; 64 channels",
       {1, 2, 4, 8, 16},
       [](std::uint32_t n) { return PlantSize{.instances = 16, .processes = 16, .hosts = n}; }},
  };
  return dimensions;
}

const Dimension& find(const std::string& name) {
  const auto found =
      std::ranges::find_if(all(), [&](const Dimension& one) { return name == one.name; });
  if (found == all().end()) {
    throw std::runtime_error(fmt::format("there is no dimension '{}'", name));
  }
  return *found;
}

/// A figure that shows a bottleneck: relative to that of the smallest size, or by itself.
struct Sign {
  const char* figure;
  const char* name;
  /// This many times that of the smallest size; 0: `limit` counts.
  double worse = 0;
  double limit = 0;
};

constexpr std::array signs{
    Sign{.figure = "known", .name = "known within 3 s", .limit = 3},
    Sign{.figure = "calls_per_second", .name = "0.8 of the calls/s", .worse = 0.8},
    Sign{.figure = "median", .name = "1.5 of the p50", .worse = 1.5},
    Sign{.figure = "gateway", .name = "1.5 of the gateway's time for a call", .worse = 1.5},
    Sign{.figure = "services", .name = "1.5 of the services' time for a call", .worse = 1.5},
    Sign{.figure = "idle", .name = "20 % of a core without calls", .limit = 20},
};

bool gives_way(const Sign& sign, const Row& first, const Row& row) {
  if (!row.has(sign.figure)) {
    return true;
  }
  const double value = row.get(sign.figure);
  if (sign.worse == 0) {
    return value > sign.limit;
  }
  const double bound = sign.worse * first.get(sign.figure);
  return sign.worse < 1 ? value < bound : value > bound;
}

std::string header() {
  return fmt::format("{:>16}{:>9}{:>10}{:>7}{:>9}{:>15}{:>8}{:>7}{:>10}{:>11}\n", "", "known s",
                     "calls/s", "us gw", "services", "p50 / p99 us", "idle %", "= gw", "services",
                     "observers");
}

std::string line(const Dimension& of, std::uint32_t size, const Row& row) {
  return fmt::format(
      "{:>5} {:<10}{:>9}{:>10}{:>7}{:>9}{:>15}{:>8}{:>7}{:>10}{:>11}\n", size, of.name,
      row.text("known", 1), row.text("calls_per_second"), row.text("gateway"), row.text("services"),
      row.text("median") + " / " + row.text("p99"), row.text("idle", 1),
      row.text("idle_gateways", 1), row.text("idle_services", 1), row.text("idle_observers", 1));
}

/// The first size at which a sign exceeds that of the smallest size.
std::string first_bottleneck(const Dimension& of,
                             const std::vector<std::pair<std::uint32_t, Row>>& rows) {
  for (const auto& [size, row] : rows) {
    std::string what;
    for (const Sign& sign : signs) {
      if (gives_way(sign, rows.front().second, row)) {
        what += fmt::format("{}{}", what.empty() ? "" : "; ", sign.name);
      }
    }
    if (!what.empty()) {
      return fmt::format("  first bottleneck, with {} {}: {}\n", size, of.name, what);
    }
  }
  return "  no bottleneck\n";
}

bool measure(const Dimension& of, const ScaleOptions& options) {
  fmt::print("{}: {}\n{}", of.name, of.beside, header());
  bool complete = true;
  std::vector<std::pair<std::uint32_t, Row>> rows;
  for (const std::uint32_t size : options.sizes.empty() ? of.sizes : options.sizes) {
    const Row row = measure_row({"scale", "--of", of.name, "--sizes", std::to_string(size),
                                 "--idle", std::to_string(options.idle_seconds)},
                                limit_of_row);
    fmt::print("{}{}", line(of, size, row), row.trouble);
    std::fflush(stdout);
    complete &= row.has("idle");
    rows.emplace_back(size, row);
  }
  fmt::print("{}", first_bottleneck(of, rows));
  return complete;
}

}  // namespace

std::vector<std::string> dimensions() {
  std::vector<std::string> names;
  for (const Dimension& one : all()) {
    names.emplace_back(one.name);
  }
  return names;
}

bool measure_scale(const ScaleOptions& options) {
  fmt::print(
      "controllers in memory, inline handlers, every process on this machine. known: from the last "
      "start until\nall instances are; calls/s: a call under way on every channel; us: processor "
      "time for a call; p50: one\ncall at a time; idle: without calls, over {} s, % of one core\n",
      options.idle_seconds);
  bool complete = true;
  for (const std::string& name : options.of.empty() ? dimensions() : options.of) {
    complete &= measure(find(name), options);
  }
  return complete;
}

void measure_scale_row(const ScaleOptions& options) {
  measure_plant(find(options.of.front()).plant(options.sizes.front()), options.idle_seconds);
}

}  // namespace millrace::bench
