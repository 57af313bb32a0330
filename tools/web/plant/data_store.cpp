#include "tools/web/plant/data_store.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <type_traits>

#include "base/text/ascii.hpp"
#include "fabric/alarm.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/data.hpp"
#include "tools/print/data.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

using fabric::DataSample;
using fabric::Quality;
using fabric::Value;

/// Slightly more than four points a second, for as long as lines are kept.
constexpr std::size_t most_points_of_one = 7'200;
constexpr std::size_t most_changes_of_one = 20;
constexpr std::size_t fewest_changes_of_one = 2;
constexpr std::size_t longest_change = 200;

/// A sample's own time is untrusted.
fabric::Time plausible(fabric::Time claimed, fabric::Time received) {
  constexpr std::chrono::hours most{24};
  const bool is = claimed > received - most && claimed < received + most;
  return is ? claimed : received;
}

std::size_t bytes_of(const Value& value) {
  const auto of_texts = [](const auto& elements) {
    std::size_t sum = 0;
    for (const auto& element : elements) {
      if constexpr (std::is_same_v<std::decay_t<decltype(element)>, std::string>) {
        sum += element.size();
      }
      sum += sizeof element;
    }
    return sum;
  };
  return sizeof value + value.name.size() + value.reason.text.size() +
         std::visit(of_texts, value.elements);
}

std::size_t bytes_of(const DataSample& sample) {
  std::size_t sum = sizeof sample;
  for (const Value& value : sample.values) {
    sum += bytes_of(value);
  }
  return sum;
}

/// A single number for a line; nothing for other values.
std::optional<double> number_of(const Value& value) {
  if (value.is_array || fabric::count(value.elements) != 1) {
    return std::nullopt;
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&value.elements)) {
    return static_cast<double>(integers->front());
  }
  if (const auto* reals = std::get_if<std::vector<double>>(&value.elements)) {
    return std::isfinite(reals->front()) ? reals->front() : Series::unknown;
  }
  return std::nullopt;
}

bool is_number(const Value& value) {
  return !value.is_array && value.type != fabric::ValueType::string;
}

std::int64_t ms_of(fabric::Time time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

/// The first elements of a long array, and how many there are.
boost::json::object json_of(const Value& value, std::size_t most) {
  const std::size_t count = fabric::count(value.elements);
  if (!value.is_array || count <= most) {
    return print::json_of(value);
  }
  Value start = value;
  std::visit([&](auto& elements) { elements.resize(most); }, start.elements);
  boost::json::object out = print::json_of(start);
  out["elements"] = count;
  return out;
}

}  // namespace

void DataStore::add(const DataSample& sample, fabric::Time received) {
  const Key key{sample.key, sample.group};
  const auto known = groups_.find(key);
  if (sample.values.empty()) {
    left_out_.erase(key);
    if (known != groups_.end()) {
      forget(known->second, plausible(sample.at, received));
      known->second.is_silent = false;
      known->second.received = received;
    }
    return;
  }
  Group* group = group_for(key, sample);
  if (group == nullptr) {
    if (left_out_.size() < limits_.groups || left_out_.contains(key)) {
      left_out_.insert_or_assign(key, received);
    }
    return;
  }
  group->is_gone = group->is_silent = false;
  group->received = received;
  group->last = sample;
  const fabric::Time at = plausible(sample.at, received);
  for (const Value& value : sample.values) {
    add(group->variables.at(value.name), value,
        value.quality == Quality::good ? plausible(value.at, at) : at);
  }
}

DataStore::Group* DataStore::group_for(const Key& key, const DataSample& sample) {
  const std::size_t bytes = bytes_of(sample);
  const auto known = groups_.find(key);
  const bool is_known = known != groups_.end();
  const std::size_t had = is_known ? known->second.bytes : 0;
  std::set<std::string_view> names;
  for (const Value& value : sample.values) {
    names.insert(value.name);
  }
  const std::size_t had_names = is_known ? known->second.variables.size() : 0;
  const bool fits = bytes <= limits_.bytes_of_group && bytes_ - had + bytes <= limits_.bytes &&
                    variables_ - had_names + names.size() <= limits_.variables &&
                    (is_known || groups_.size() < limits_.groups);
  if (!fits) {
    if (is_known) {
      drop(known);
    }
    return nullptr;
  }
  left_out_.erase(key);
  Group& group = is_known ? known->second : groups_[key];
  bytes_ += bytes - had;
  group.bytes = bytes;
  // A new configuration may have other variables.
  std::erase_if(group.variables, [&](const auto& each) { return !names.contains(each.first); });
  if (group.variables.size() != names.size()) {
    for (const std::string_view name : names) {
      group.variables.try_emplace(std::string(name));
    }
  }
  if (group.variables.size() != had_names) {
    variables_ += group.variables.size() - had_names;
    share_again();
  }
  return &group;
}

void DataStore::add(Variable& variable, const Value& value, fabric::Time at) {
  if (value.quality != Quality::good || is_number(value)) {
    const double number = value.quality == Quality::good
                              ? number_of(value).value_or(Series::unknown)
                              : Series::unknown;
    if (!variable.series.points().empty() || !std::isnan(number)) {
      variable.series.add(at, number, most_points_);
    }
    return;
  }
  std::string text = fabric::shortened(print::text_of(value), longest_change);
  if (variable.changes.empty() || variable.changes.back().text != text) {
    variable.changes.push_back({at, std::move(text)});
  }
  while (variable.changes.size() > most_changes_) {
    variable.changes.pop_front();
  }
}

void DataStore::forget(Group& group, fabric::Time now) {
  group.is_gone = true;
  for (auto& [name, variable] : group.variables) {
    const auto& points = variable.series.points();
    if (!points.empty()) {
      variable.series.add(std::max(now, points.back().at), Series::unknown, most_points_);
    }
  }
}

void DataStore::silence(const std::string& machine, fabric::Time now) {
  for (auto group = groups_.lower_bound({{machine, 0}, {}});
       group != groups_.end() && group->first.first.machine.starts_with(machine); ++group) {
    // Also the groups of its message queues, "cnc.ALARMS".
    if (fabric::machine_of(group->first.first.machine) == machine && !group->second.is_gone) {
      forget(group->second, now);
      group->second.is_silent = true;
      group->second.received = now;
    }
  }
}

void DataStore::end_silence(const std::string& machine, bool same, fabric::Time now) {
  for (auto group = groups_.lower_bound({{machine, 0}, {}});
       group != groups_.end() && group->first.first.machine.starts_with(machine); ++group) {
    if (fabric::machine_of(group->first.first.machine) != machine || !group->second.is_silent) {
      continue;
    }
    group->second.is_silent = false;
    if (same) {
      group->second.is_gone = false;
      for (const Value& value : group->second.last.values) {
        add(group->second.variables.at(value.name), value, now);
      }
    }
  }
}

void DataStore::forget_old(fabric::Time now) {
  for (auto group = groups_.begin(); group != groups_.end();) {
    const auto next = std::next(group);
    if (group->second.is_gone && now - group->second.received > Series::kept) {
      drop(group);
    }
    group = next;
  }
  std::erase_if(left_out_, [&](const auto& each) { return now - each.second > Series::kept; });
}

void DataStore::drop(std::map<Key, Group>::iterator group) {
  bytes_ -= group->second.bytes;
  variables_ -= group->second.variables.size();
  groups_.erase(group);
  share_again();
}

void DataStore::share_again() {
  const std::size_t sharers = std::max<std::size_t>(variables_, 1);
  const std::size_t before = most_points_;
  most_points_ = std::min(most_points_of_one, limits_.points / sharers);
  most_changes_ = std::clamp(limits_.changes / sharers, fewest_changes_of_one, most_changes_of_one);
  if (most_points_ >= before) {
    return;
  }
  for (auto& [key, group] : groups_) {
    for (auto& [name, variable] : group.variables) {
      variable.series.shorten_to(most_points_);
      while (variable.changes.size() > most_changes_) {
        variable.changes.pop_front();
      }
    }
  }
}

void DataStore::add_machines(std::set<std::string>& names) const {
  for (const auto& [key, group] : groups_) {
    names.insert(key.first.machine);
  }
}

std::map<std::pair<std::string, Quality>, std::size_t> DataStore::qualities() const {
  std::map<std::pair<std::string, Quality>, std::size_t> counts;
  for (const auto& [key, group] : groups_) {
    for (const Value& value : group.last.values) {
      ++counts[{key.first.machine, group.is_gone ? Quality::stale : value.quality}];
    }
  }
  return counts;
}

std::vector<const DataSample*> DataStore::queues() const {
  std::vector<const DataSample*> queues;
  for (const auto& [key, group] : groups_) {
    if (!group.is_gone && fabric::is_queue(group.last)) {
      queues.push_back(&group.last);
    }
  }
  return queues;
}

boost::json::array DataStore::samples(const DataFilter& filter) const {
  boost::json::array out;
  for (const auto& [key, group] : groups_) {
    const bool is_wanted = (filter.machine.empty() || filter.machine == key.first.machine) &&
                           (filter.channel == 0 || filter.channel == key.first.channel) &&
                           (filter.group.empty() || filter.group == key.second);
    if (!is_wanted) {
      continue;
    }
    boost::json::object object;
    print::put_time(object, "time", group.received);
    object["kind"] = "data";
    const DataSample head = {.key = group.last.key,
                             .group = group.last.group,
                             .at = group.last.at,
                             .period = group.last.period,
                             .wanted = group.last.wanted,
                             .replayed = group.last.replayed};
    print::put_fields(object, head);
    boost::json::array values;
    for (const Value& value : group.last.values) {
      values.push_back(plant::json_of(value, filter.most_elements));
    }
    object["values"] = std::move(values);
    object["gone"] = group.is_gone;
    out.push_back(std::move(object));
  }
  return out;
}

boost::json::object DataStore::line_of(const Key& key, const Group& group, const Value& value,
                                       const Variable& variable, fabric::Time since) {
  boost::json::object out{{"channel", key.first.channel},
                          {"group", print::utf8(key.second)},
                          {"period_ms", group.last.period / std::chrono::milliseconds(1)},
                          {"replayed", group.last.replayed},
                          {"gone", group.is_gone}};
  out["name"] = print::utf8(value.name);
  out["type"] = fabric::name_of(value.type);
  out["quality"] = fabric::name_of(value.quality);
  out["text"] = fabric::shortened(print::text_of(value), longest_change);
  out["array"] = value.is_array;
  if (!value.is_array) {
    out["value"] = print::json_of_elements(value);
  }
  print::put_time(out, "at", value.at);
  if (!value.reason.empty()) {
    print::put_message(out, "reason", value.reason);
  }
  const auto& points = variable.series.points();
  // A reader whose last points are gone gets the whole line.
  const bool whole = since == fabric::Time{} || points.empty() || points.back().at < since ||
                     points.front().at > since;
  const auto first =
      whole ? points.begin() : std::ranges::lower_bound(points, since, {}, &Series::Point::at);
  boost::json::array times;
  boost::json::array values;
  const bool is_real = value.type == fabric::ValueType::real64;
  for (auto point = first; point != points.end(); ++point) {
    times.emplace_back(ms_of(point->at));
    if (std::isnan(point->value)) {
      values.emplace_back(nullptr);
    } else if (is_real) {
      values.emplace_back(point->value);
    } else {
      values.emplace_back(static_cast<std::int64_t>(point->value));
    }
  }
  out["whole"] = whole;
  out["times"] = std::move(times);
  out["values"] = std::move(values);
  if (!variable.changes.empty()) {
    boost::json::array changes;
    for (const Change& change : variable.changes) {
      changes.push_back(boost::json::object{{"at", ms_of(change.at)}, {"text", change.text}});
    }
    out["changes"] = std::move(changes);
  }
  return out;
}

boost::json::object DataStore::history(const std::string& machine,
                                       const std::vector<LineRequest>& wanted,
                                       fabric::Time now) const {
  boost::json::array series;
  for (const LineRequest& each : wanted) {
    // The separator is '/': channel numbers and group names have none.
    const std::size_t first = each.variable.find('/');
    const std::size_t second = each.variable.find('/', first + 1);
    const auto channel =
        base::text::parse_number<std::uint16_t>(std::string_view(each.variable).substr(0, first));
    if (first == std::string::npos || second == std::string::npos || !channel) {
      continue;
    }
    const auto group =
        groups_.find({{machine, *channel}, each.variable.substr(first + 1, second - first - 1)});
    if (group == groups_.end()) {
      continue;
    }
    const std::string name = each.variable.substr(second + 1);
    const auto variable = group->second.variables.find(name);
    const auto value = std::ranges::find(group->second.last.values, name, &Value::name);
    if (variable != group->second.variables.end() && value != group->second.last.values.end()) {
      boost::json::object line =
          line_of(group->first, group->second, *value, variable->second, each.since);
      line["variable"] = each.variable;
      series.push_back(std::move(line));
    }
  }
  boost::json::object out{{"series", std::move(series)}};
  print::put_time(out, "time", now);
  return out;
}

}  // namespace millrace::tools::web::plant
