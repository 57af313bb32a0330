#include "tools/print/hop_report.hpp"

#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using recording::Histogram;

double milliseconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Calls `use(uuid, hop, histogram)` for each hop that was measured.
template <typename Use>
void for_each_hop(const recording::HopStatistics& hops, Use use) {
  for (const auto& [uuid, histograms] : hops.services()) {
    for (std::size_t i = 0; i < histograms.size(); ++i) {
      if (histograms.at(i).count() > 0) {
        use(uuid, name_of(static_cast<recording::Hop>(i)), histograms.at(i));
      }
    }
  }
}

}  // namespace

std::string hops_text(const recording::HopStatistics& hops) {
  Table table({{"SERVICE"},
               {"HOP"},
               {"CALLS", Align::right},
               {"P50", Align::right},
               {"P99", Align::right},
               {"MAX", Align::right}});
  for_each_hop(hops, [&](const std::string& uuid, std::string_view hop, const Histogram& times) {
    table.add({utf8(uuid), std::string(hop), std::to_string(times.count()),
               duration_text(times.percentile(0.5)), duration_text(times.percentile(0.99)),
               duration_text(times.max())});
  });
  return table.empty() ? "no call was answered in this recording\n" : table.text();
}

boost::json::array hops_json(const recording::HopStatistics& hops) {
  boost::json::array out;
  for_each_hop(hops, [&](const std::string& uuid, std::string_view hop, const Histogram& times) {
    out.push_back({{"uuid", utf8(uuid)},
                   {"hop", hop},
                   {"calls", times.count()},
                   {"p50_ms", milliseconds(times.percentile(0.5))},
                   {"p99_ms", milliseconds(times.percentile(0.99))},
                   {"max_ms", milliseconds(times.max())}});
  });
  return out;
}

}  // namespace millrace::tools::print
