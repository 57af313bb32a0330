#include "fabric/alarm_table.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::fabric {

namespace {

// Limits of idl/alarm.idl.
constexpr std::size_t most_kind = 31;
constexpr std::size_t most_name = 63;

constexpr const char* kind_of_the_rest = "more";

/// A NUL would end the text for other readers.
std::string one_text(std::string_view text, std::size_t most) {
  std::string fitting = shortened(text, most);
  std::ranges::replace(fitting, '\0', ' ');
  return fitting;
}

}  // namespace

void AlarmTable::raise(const Alarm& alarm, Time now) {
  const AlarmKey key{who_.key.responder, one_text(alarm.key.kind, most_kind),
                     one_text(alarm.key.subject, most_name)};
  const auto before = all_.find(key);
  all_.insert_or_assign(key, Alarm{.key = key,
                                   .level = alarm.level,
                                   .text = alarm.text,
                                   .advice = alarm.advice,
                                   .since = before == all_.end() ? now : before->second.since,
                                   .program = one_text(who_.program, most_name),
                                   .host = one_text(who_.host, most_name),
                                   .pid = who_.pid});
}

void AlarmTable::clear(const std::string& kind, const std::string& subject) {
  all_.erase({who_.key.responder, one_text(kind, most_kind), one_text(subject, most_name)});
}

AlarmTable::Published AlarmTable::wanted() const {
  if (all_.size() <= most) {
    return all_;
  }
  // The worst first, so that the omitted ones matter least.
  std::vector<const Alarm*> order;
  order.reserve(all_.size());
  for (const auto& [key, alarm] : all_) {
    order.push_back(&alarm);
  }
  std::ranges::stable_sort(order, std::ranges::greater{}, &Alarm::level);
  Published wanted;
  for (std::size_t i = 0; i + 1 < most; ++i) {
    wanted.emplace(order[i]->key, *order[i]);
  }
  const Alarm& next = *order[most - 1];
  Alarm rest = next;
  rest.key = {who_.key.responder, kind_of_the_rest, {}};
  rest.text = fmt::format("{} more alarms are not published one by one", all_.size() - (most - 1));
  rest.advice = "see its log";
  wanted.insert_or_assign(rest.key, rest);
  return wanted;
}

AlarmTable::Changes AlarmTable::changes() {
  Published now = wanted();
  Changes changes;
  for (const auto& [key, alarm] : now) {
    const auto before = published_.find(key);
    if (before == published_.end() || before->second != alarm) {
      changes.to_publish.push_back(alarm);
    }
  }
  for (const auto& [key, alarm] : published_) {
    if (!now.contains(key)) {
      changes.to_dispose.push_back(alarm);
    }
  }
  published_ = std::move(now);
  return changes;
}

}  // namespace millrace::fabric
