#include "gateway/core/error_series.hpp"

namespace millrace::gateway::core {

std::optional<fabric::AlarmLevel> ErrorSeries::on_error(const std::string& uuid, SteadyTime now) {
  if (series_.size() >= most && !series_.contains(uuid)) {
    return std::nullopt;
  }
  Series& series = series_[uuid];
  ++series.errors;
  series.last = now;
  return series.errors == warned_at    ? std::optional(fabric::AlarmLevel::warning)
         : series.errors == problem_at ? std::optional(fabric::AlarmLevel::problem)
                                       : std::nullopt;
}

bool ErrorSeries::on_success(const std::string& uuid) {
  const auto series = series_.extract(uuid);
  return !series.empty() && series.mapped().errors >= warned_at;
}

std::vector<std::string> ErrorSeries::on_time(SteadyTime now) {
  std::vector<std::string> over;
  std::erase_if(series_, [&](const auto& each) {
    const bool is_old = now - each.second.last >= kept;
    if (is_old && each.second.errors >= warned_at) {
      over.push_back(each.first);
    }
    return is_old;
  });
  return over;
}

std::size_t ErrorSeries::length(const std::string& uuid) const {
  const auto series = series_.find(uuid);
  return series == series_.end() ? 0 : series->second.errors;
}

}  // namespace millrace::gateway::core
