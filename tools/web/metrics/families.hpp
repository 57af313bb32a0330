// Builds the metric families for Prometheus, one sample after the other. Pure.
//
//   Families families;
//   families.gauge("millrace_link_up", "Whether …").add({{"machine", "cnc"}}, 1);
//   families.text()
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <prometheus/metric_family.h>

namespace millrace::tools::web::metrics {

/// Names and values; values are converted to UTF-8.
using Labels = std::vector<std::pair<std::string, std::string>>;

/// The label for everything beyond the limits.
inline constexpr const char* other = "other";

/// As one word: "link_down", "to_service".
std::string one_word(std::string_view words);

/// Points in time and durations in Prometheus' unit.
double seconds_of(std::chrono::system_clock::time_point time);
double seconds_of(std::chrono::nanoseconds duration);

/// Fixed bounds, so that the counts of several hosts can be added. They range from one hop on a
/// host to a program that waits for an operator.
class Buckets {
 public:
  void add(std::chrono::nanoseconds duration);
  [[nodiscard]] prometheus::ClientMetric::Histogram histogram() const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  double sum_ = 0;
};

class Family {
 public:
  explicit Family(prometheus::MetricFamily& family) : family_(family) {}

  void add(const Labels& labels, double value);
  void add(const Labels& labels, const Buckets& buckets);

 private:
  prometheus::MetricFamily& family_;
};

class Families {
 public:
  // Names and units follow Prometheus' conventions: base units, a counter ends with _total.
  Family gauge(std::string name, std::string help);
  Family counter(std::string name, std::string help);
  Family histogram(std::string name, std::string help);

  /// In the text format 0.0.4; a family without samples is left out.
  [[nodiscard]] std::string text() const;

 private:
  Family add(std::string name, std::string help, prometheus::MetricType type);

  std::vector<std::unique_ptr<prometheus::MetricFamily>> families_;
};

}  // namespace millrace::tools::web::metrics
