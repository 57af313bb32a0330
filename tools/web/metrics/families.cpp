#include "tools/web/metrics/families.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include <prometheus/text_serializer.h>

#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::metrics {

namespace {

/// Seconds.
constexpr std::array<double, 17> bounds{50e-6, 100e-6, 250e-6, 500e-6, 1e-3, 2.5e-3,
                                        5e-3,  10e-3,  25e-3,  50e-3,  0.1,  0.25,
                                        0.5,   1,      5,      30,     300};

prometheus::ClientMetric metric_with(const Labels& labels) {
  prometheus::ClientMetric metric;
  for (const auto& [name, value] : labels) {
    metric.label.push_back({name, base::text::safe(print::utf8(value), "\n")});
  }
  return metric;
}

}  // namespace

std::string one_word(std::string_view words) {
  std::string word(words);
  std::ranges::replace(word, ' ', '_');
  return word;
}

double seconds_of(std::chrono::system_clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

double seconds_of(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

void Buckets::add(std::chrono::nanoseconds duration) {
  // Clocks of two hosts differ, so a duration may be negative.
  const double seconds = std::max(0.0, std::chrono::duration<double>(duration).count());
  counts_.resize(bounds.size());
  const auto place = std::ranges::lower_bound(bounds, seconds);
  if (place != bounds.end()) {
    ++counts_.at(static_cast<std::size_t>(place - bounds.begin()));
  }
  ++count_;
  sum_ += seconds;
}

prometheus::ClientMetric::Histogram Buckets::histogram() const {
  prometheus::ClientMetric::Histogram histogram;
  histogram.sample_count = count_;
  histogram.sample_sum = sum_;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    sum += counts_.empty() ? 0 : counts_.at(i);
    histogram.bucket.push_back({sum, bounds.at(i)});
  }
  return histogram;
}

void Family::add(const Labels& labels, double value) {
  prometheus::ClientMetric metric = metric_with(labels);
  if (family_.type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  family_.metric.push_back(std::move(metric));
}

void Family::add(const Labels& labels, const Buckets& buckets) {
  prometheus::ClientMetric metric = metric_with(labels);
  metric.histogram = buckets.histogram();
  family_.metric.push_back(std::move(metric));
}

Family Families::add(std::string name, std::string help, prometheus::MetricType type) {
  families_.push_back(std::make_unique<prometheus::MetricFamily>(
      prometheus::MetricFamily{std::move(name), std::move(help), type, {}}));
  return Family(*families_.back());
}

Family Families::gauge(std::string name, std::string help) {
  return add(std::move(name), std::move(help), prometheus::MetricType::Gauge);
}

Family Families::counter(std::string name, std::string help) {
  return add(std::move(name), std::move(help), prometheus::MetricType::Counter);
}

Family Families::histogram(std::string name, std::string help) {
  return add(std::move(name), std::move(help), prometheus::MetricType::Histogram);
}

std::string Families::text() const {
  std::vector<prometheus::MetricFamily> filled;
  for (const auto& family : families_) {
    if (!family->metric.empty()) {
      filled.push_back(*family);
    }
  }
  std::ostringstream out;
  prometheus::TextSerializer().Serialize(out, filled);
  return out.str();
}

}  // namespace millrace::tools::web::metrics
