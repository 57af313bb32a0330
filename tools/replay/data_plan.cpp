#include "tools/replay/data_plan.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"

namespace millrace::tools::replay {

namespace {

using fabric::ProgramEventKind;

/// A program may have begun long before the recording. A time that is farther away is not a time of
/// this recording.
constexpr std::chrono::hours far{24 * 366};

}  // namespace

void DataPlan::add(const recording::Entry& entry) {
  if (std::holds_alternative<fabric::DataSample>(entry.sample)) {
    ++samples_;
  } else if (std::holds_alternative<fabric::ProgramEvent>(entry.sample)) {
    ++events_;
  } else {
    return;
  }
  channels_.insert(*recording::channel_of(entry));
  if (!first_) {
    first_ = last_ = entry.at;
  }
  // Entries of a file are not strictly in the order of reception.
  if (max_gap_ != nanoseconds{} && entry.at - last_ > max_gap_) {
    const nanoseconds before = cuts_.empty() ? nanoseconds{} : cuts_.back().second;
    cuts_.emplace_back(entry.at, before + (entry.at - last_ - max_gap_));
  }
  last_ = std::max(last_, entry.at);
}

nanoseconds DataPlan::cut_before(fabric::Time time) const {
  const auto next = std::ranges::upper_bound(cuts_, time, {}, &decltype(cuts_)::value_type::first);
  return next == cuts_.begin() ? nanoseconds{} : std::prev(next)->second;
}

nanoseconds DataPlan::due(fabric::Time received) const {
  if (!first_ || pace_.timing == Timing::fast) {
    return {};
  }
  return std::max(nanoseconds{}, pace_.scaled(received - *first_ - cut_before(received)));
}

fabric::Time DataPlan::moved(fabric::Time recorded, fabric::Time start) const {
  if (!first_ || recorded < *first_ - far || recorded > last_ + far) {
    return recorded;
  }
  const nanoseconds cut = cut_before(recorded);
  if (pace_.timing == Timing::fast) {
    return start - (last_ - cut_before(last_) - (recorded - cut));
  }
  return start + pace_.scaled(recorded - *first_ - cut);
}

fabric::DataSample DataPlan::replayed(fabric::DataSample sample, fabric::ChannelKey key,
                                      fabric::Time start) const {
  sample.key = std::move(key);
  sample.at = moved(sample.at, start);
  for (fabric::Value& value : sample.values) {
    value.at = moved(value.at, start);
  }
  sample.replayed = true;
  return sample;
}

fabric::ProgramEvent DataPlan::replayed(fabric::ProgramEvent event, fabric::ChannelKey key,
                                        fabric::Time start) const {
  event.key = std::move(key);
  event.at = moved(event.at, start);
  event.started = moved(event.started, start);
  event.replayed = true;
  return event;
}

void PublishedValues::add(const fabric::DataSample& sample) {
  if (sample.values.empty()) {
    groups_.erase({sample.key, sample.group});
  } else {
    groups_.emplace(sample.key, sample.group);
  }
}

void PublishedValues::add(const fabric::ProgramEvent& event) {
  programs_.insert_or_assign(event.key, event);
}

std::vector<fabric::ProgramEvent> PublishedValues::resets(fabric::Time now) const {
  std::vector<fabric::ProgramEvent> resets;
  for (const auto& [key, last] : programs_) {
    const bool runs = last.kind == ProgramEventKind::started ||
                      last.kind == ProgramEventKind::on_hold ||
                      last.kind == ProgramEventKind::resumed;
    if (runs) {
      fabric::ProgramEvent reset = last;
      reset.kind = ProgramEventKind::reset;
      reset.at = std::max(now, last.at);
      reset.detail = base::messages::replay_has_ended();
      resets.push_back(std::move(reset));
    }
  }
  return resets;
}

std::vector<fabric::DataSample> PublishedValues::groups() const {
  std::vector<fabric::DataSample> groups;
  groups.reserve(groups_.size());
  for (const auto& [channel, group] : groups_) {
    groups.push_back({.key = channel, .group = group});
  }
  return groups;
}

std::vector<fabric::ProgramEvent> PublishedValues::programs() const {
  std::vector<fabric::ProgramEvent> programs;
  programs.reserve(programs_.size());
  for (const auto& [key, last] : programs_) {
    programs.push_back({.key = key});
  }
  return programs;
}

}  // namespace millrace::tools::replay
