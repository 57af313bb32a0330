#include "services/mail/rule_watch.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "fabric/plant/assess.hpp"
#include "fabric/plant/expectations.hpp"
#include "fabric/words.hpp"
#include "services/mail/compose.hpp"

namespace millrace::services::mail {

namespace {

using fabric::Moment;
using fabric::Time;
using fabric::plant::Concern;

/// Ended instances and processes that are gone are of interest for so long.
constexpr std::chrono::minutes kept_gone{15};

std::string seconds_text(std::chrono::nanoseconds time) {
  return fmt::format("{:.1f}", std::chrono::duration<double>(time).count());
}

/// FNV-1a: the same in every build.
std::uint64_t hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  }
  return hash;
}

/// A mail may contain only UTF-8; foreign texts may contain other bytes.
std::string shown_text(const std::string& text) {
  return base::text::is_utf8(text) ? text : base::text::to_utf8(text);
}

bool is_for(const Rule& rule, const std::string& machine) {
  return rule.machines.empty() || rule.machines.contains(machine);
}

bool selects(const Rule& rule, const Concern& concern) {
  return concern.level >= rule.least && (rule.kinds.empty() || rule.kinds.contains(concern.kind)) &&
         (rule.machines.empty() ||
          std::ranges::any_of(concern.machines, [&](const std::string& machine) {
            return rule.machines.contains(machine);
          }));
}

std::string subject_text(const Concern& concern) {
  const std::string subject = fabric::plant::subject_of(concern).text;
  return subject.empty() ? "plant" : shown_text(subject);
}

/// `flags` for a command, where the concern has no advice.
Values values_of(const Concern& concern, const std::string& flags) {
  const std::string advice = fabric::plant::advice_of(concern.todo);
  return {{"subject", subject_text(concern)},
          {"kind", std::string(name_of(concern.kind))},
          {"level", std::string(name_of(concern.level))},
          {"who", std::string(name_of(concern.who))},
          {"what", shown_text(concern.what.text)},
          {"reason", shown_text(concern.why.text)},
          {"todo", advice.empty() ? "see `millrace status" + flags + "`" : shown_text(advice)},
          {"machine", shown_text(fmt::format("{}", fmt::join(concern.machines, ", ")))},
          {"channel",
           concern.channels.size() == 1 ? std::to_string(concern.channels.front().channel) : ""},
          {"uuid", shown_text(concern.uuid)}};
}

}  // namespace

const std::set<std::string>& rule_keys() {
  static const std::set<std::string> keys{"rule",    "subject", "kind",  "level",    "who",
                                          "what",    "reason",  "todo",  "machine",  "uuid",
                                          "channel", "event",   "error", "duration", "parts",
                                          "program", "time",    "since", "seconds",  "unsaid"};
  return keys;
}

RuleWatch::RuleWatch(std::vector<Rule> rules, std::string flags, Moment now)
    : rules_(std::move(rules)), flags_(std::move(flags)) {
  if (!std::ranges::all_of(rules_,
                           [](const Rule& rule) { return rule.kind == Rule::Kind::program; })) {
    judge_at_ = now.steady + settle;
  }
}

void RuleWatch::on_entry(const fabric::observer::Entry& entry, Moment now) {
  if (const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
    on_event(*event, now);
  }
  plant_.add(entry);
  on_time(now);
}

void RuleWatch::on_event(const fabric::ProgramEvent& event, Moment now) {
  if (event.replayed || now.wall - event.at > history) {
    return;
  }
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (rule.kind != Rule::Kind::program || !rule.events.contains(event.kind) ||
        !is_for(rule, event.key.machine)) {
      continue;
    }
    const std::string channel = event.key.to_string();
    Values values{{"subject", shown_text(channel)},
                  {"machine", shown_text(event.key.machine)},
                  {"channel", std::to_string(event.key.channel)}};
    values["program"] = base::text::to_utf8(event.program);
    values["event"] = fabric::name_of(event.kind);
    values["error"] = event.error == 0 ? "" : std::to_string(event.error);
    values["parts"] = event.parts ? std::to_string(*event.parts) : "";
    values["duration"] = event.started == Time{} ? "" : seconds_text(event.at - event.started);
    values["reason"] = shown_text(event.detail);
    tell({i, channel}, channel, event.at, std::move(values), now);
  }
}

void RuleWatch::on_time(Moment now) {
  if (judge_at_ && now.steady >= *judge_at_) {
    judge(now);
    judge_at_ = now.steady + judge_period;
  }
}

void RuleWatch::judge(Moment now) {
  plant_.forget_gone(now.wall - kept_gone);
  for (auto& [place, lasting] : lasting_) {
    lasting.found = false;
  }
  const auto concerns = fabric::plant::assess(plant_, now.wall, {.flags = flags_});
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (rule.kind == Rule::Kind::no_instance) {
      for (const Concern& concern : fabric::plant::missing_instances(plant_, {{rule.uuid, 1}})) {
        find(i, concern, now);
      }
    } else if (rule.kind == Rule::Kind::concern) {
      for (const Concern& concern : concerns) {
        if (selects(rule, concern)) {
          find(i, concern, now);
        }
      }
    }
  }
  std::erase_if(lasting_, [](const auto& each) { return !each.second.found; });
}

void RuleWatch::find(std::size_t rule, const Concern& concern, Moment now) {
  const Place place{rule, concern.cause};
  auto known = lasting_.find(place);
  if (known == lasting_.end()) {
    if (!has_room(lasting_.size())) {
      return;
    }
    const bool began = concern.since != Time{} && concern.since < now.wall;
    known = lasting_.emplace(place, Lasting{.since = began ? concern.since : now.wall}).first;
  }
  Lasting& lasting = known->second;
  lasting.found = true;
  const auto lasted = now.wall - lasting.since;
  if (lasting.reported || lasted < rules_[rule].after || is_quiet(place, now)) {
    return;
  }
  lasting.reported = true;
  Values values = values_of(concern, flags_);
  values["since"] = utc(lasting.since);
  values["seconds"] = seconds_text(lasted);
  tell(place, subject_text(concern), lasting.since, std::move(values), now);
}

bool RuleWatch::has_room(std::size_t remembered) {
  if (remembered < most_remembered) {
    return true;
  }
  if (!std::exchange(reported_full_, true)) {
    lines_.push_back(
        fmt::format("more than {} channels and causes are on the fabric: the rules ignore further "
                    "ones",
                    most_remembered));
  }
  return false;
}

bool RuleWatch::is_quiet(const Place& place, Moment now) const {
  const auto quiet = quiet_.find(place);
  return quiet != quiet_.end() && quiet->second.until > now.steady;
}

void RuleWatch::tell(const Place& place, const std::string& about, Time at, Values values,
                     Moment now) {
  const Rule& rule = rules_[place.first];
  if (!quiet_.contains(place) && quiet_.size() >= most_remembered) {
    std::erase_if(quiet_, [&](const auto& each) { return each.second.until <= now.steady; });
  }
  if (!quiet_.contains(place) && !has_room(quiet_.size())) {
    return;
  }
  Quiet& quiet = quiet_[place];
  if (quiet.until > now.steady) {
    ++quiet.unsaid;
    lines_.push_back(fmt::format("rule {}: no mail about {}: the last one was less than {} s ago",
                                 rule.name, about,
                                 std::chrono::round<std::chrono::seconds>(rule.quiet).count()));
    return;
  }
  values["rule"] = rule.name;
  values["time"] = utc(at);
  values["unsaid"] = std::to_string(std::exchange(quiet.unsaid, 0));
  quiet.until = now.steady + rule.quiet;
  for (const std::string& key : rule_keys()) {
    values.try_emplace(key);
  }
  const auto epoch = hash_of(rule.name + '\n' + place.second);
  occasions_.push_back({place.first,
                        {epoch, static_cast<std::uint64_t>(at.time_since_epoch().count())},
                        std::move(values)});
}

}  // namespace millrace::services::mail
