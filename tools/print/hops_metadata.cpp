#include "tools/print/hops_metadata.hpp"

#include <fmt/format.h>

#include "tools/print/units.hpp"

namespace millrace::tools::print {

std::map<std::string, std::string> hops_metadata(const recording::HopStatistics& hops) {
  std::map<std::string, std::string> metadata;
  for (const auto& [uuid, histograms] : hops.services()) {
    for (std::size_t i = 0; i < histograms.size(); ++i) {
      const recording::Histogram& times = histograms.at(i);
      if (times.count() > 0) {
        metadata[fmt::format("{} {}", uuid, name_of(static_cast<recording::Hop>(i)))] = fmt::format(
            "calls {}, p50 {}, p99 {}, max {}", times.count(), duration_text(times.percentile(0.5)),
            duration_text(times.percentile(0.99)), duration_text(times.max()));
      }
    }
  }
  return metadata;
}

}  // namespace millrace::tools::print
