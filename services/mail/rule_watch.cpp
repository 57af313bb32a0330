#include "services/mail/rule_watch.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "fabric/words.hpp"
#include "services/mail/compose.hpp"

namespace millrace::services::mail {

namespace {

using fabric::ChannelState;
using fabric::Moment;
using fabric::Time;

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

Values channel_values(const fabric::ChannelKey& key) {
  return {{"machine", shown_text(key.machine)}, {"channel", std::to_string(key.channel)}};
}

bool waits(ChannelState state) {
  return state == ChannelState::waiting || state == ChannelState::unserved ||
         state == ChannelState::held;
}

}  // namespace

const std::set<std::string>& rule_keys() {
  static const std::set<std::string> keys{"rule",   "machine", "channel",  "program", "event",
                                          "error",  "parts",   "duration", "state",   "uuid",
                                          "reason", "since",   "seconds",  "time",    "unsaid"};
  return keys;
}

RuleWatch::RuleWatch(std::vector<Rule> rules, Moment now) : rules_(std::move(rules)) {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (rules_[i].kind == Rule::Kind::no_instance) {
      begin({i, rules_[i].uuid}, now.wall, {{"uuid", rules_[i].uuid}}, now);
    }
  }
}

void RuleWatch::on_entry(const fabric::observer::Entry& entry, Moment now) {
  if (const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
    on_event(*event, now);
  } else if (const auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    on_channel(*status, now);
  } else if (const auto* machine = std::get_if<fabric::MachineStatus>(&entry.sample)) {
    on_machine(*machine, now);
  } else if (const auto* news = std::get_if<fabric::observer::InstanceNews>(&entry.sample)) {
    on_instance(*news, now);
  }
  on_time(now);
}

bool RuleWatch::is_for(const Rule& rule, const std::string& machine) const {
  return rule.machines.empty() || rule.machines.contains(machine);
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
    Values values = channel_values(event.key);
    values["program"] = base::text::to_utf8(event.program);
    values["event"] = fabric::name_of(event.kind);
    values["error"] = event.error == 0 ? "" : std::to_string(event.error);
    values["parts"] = event.parts ? std::to_string(*event.parts) : "";
    values["duration"] = event.started == Time{} ? "" : seconds_text(event.at - event.started);
    values["reason"] = shown_text(event.detail);
    tell({i, event.key.to_string()}, event.at, std::move(values), now);
  }
}

void RuleWatch::on_channel(const fabric::ChannelStatus& status, Moment now) {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (rule.kind != Rule::Kind::waits || !is_for(rule, status.key.machine)) {
      continue;
    }
    const Place place{i, status.key.to_string()};
    if (!waits(status.state)) {
      end(place);
      continue;
    }
    Values values = channel_values(status.key);
    values["state"] = fabric::name_of(status.state);
    values["uuid"] = shown_text(status.uuid);
    values["reason"] = shown_text(status.reason);
    begin(place, status.since, std::move(values), now);
  }
}

/// A machine counts as disconnected if none of its gateways is connected: a second gateway stands
/// by.
void RuleWatch::on_machine(const fabric::MachineStatus& status, Moment now) {
  if (!links_.contains(status.machine) && !has_room(links_.size())) {
    return;
  }
  auto& gateways = links_[status.machine];
  gateways[status.gateway] = status.connected;
  if (status.connected) {
    // Disconnected gateways no longer matter, and one that has ended never reconnects.
    std::erase_if(gateways, [](const auto& one) { return !one.second; });
  }
  const bool up = std::ranges::any_of(gateways, [](const auto& one) { return one.second; });
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (rule.kind != Rule::Kind::link_down || !is_for(rule, status.machine)) {
      continue;
    }
    const Place place{i, status.machine};
    if (up) {
      end(place);
    } else if (!lasting_.contains(place)) {
      begin(place, status.since,
            {{"machine", shown_text(status.machine)}, {"reason", shown_text(status.reason)}}, now);
    }
  }
}

void RuleWatch::on_instance(const fabric::observer::InstanceNews& news, Moment now) {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (rule.kind != Rule::Kind::no_instance || rule.uuid != news.identity.uuid) {
      continue;
    }
    auto& ready = instances_[rule.uuid];
    if (fabric::observer::is_absent(news.change) || news.identity.draining) {
      ready.erase(news.identity.id);
    } else {
      ready.insert(news.identity.id);
    }
    const Place place{i, rule.uuid};
    if (!ready.empty()) {
      end(place);
    } else if (!lasting_.contains(place)) {
      begin(place, now.wall, {{"uuid", rule.uuid}}, now);
    }
  }
}

bool RuleWatch::has_room(std::size_t remembered) {
  if (remembered < most_remembered) {
    return true;
  }
  if (!std::exchange(reported_full_, true)) {
    lines_.push_back(fmt::format(
        "more than {} channels and machines are on the fabric: the rules ignore further ones",
        most_remembered));
  }
  return false;
}

void RuleWatch::begin(const Place& place, Time since, Values values, Moment now) {
  const auto found = lasting_.find(place);
  if (found != lasting_.end() && found->second.since == since) {
    found->second.values = std::move(values);
    return;
  }
  if (found == lasting_.end() && !has_room(lasting_.size())) {
    return;
  }
  // Another host's clock may be ahead.
  const auto lasted = std::max(now.wall - since, std::chrono::nanoseconds::zero());
  lasting_[place] = {
      since,
      now.steady + std::max(rules_[place.first].after - lasted, std::chrono::nanoseconds::zero()),
      std::move(values)};
}

void RuleWatch::on_time(Moment now) {
  for (auto& [place, lasting] : lasting_) {
    if (lasting.told || lasting.due > now.steady) {
      continue;
    }
    const auto quiet = quiet_.find(place);
    if (quiet != quiet_.end() && quiet->second.until > now.steady) {
      // If the condition lasts until then, it is reported then.
      lasting.due = quiet->second.until;
      continue;
    }
    lasting.told = true;
    Values values = lasting.values;
    values["since"] = utc(lasting.since);
    values["seconds"] = seconds_text(now.wall - lasting.since);
    tell(place, lasting.since, std::move(values), now);
  }
}

std::optional<fabric::SteadyTime> RuleWatch::next_time() const {
  std::optional<fabric::SteadyTime> next;
  for (const auto& [place, lasting] : lasting_) {
    if (!lasting.told) {
      next = next ? std::min(*next, lasting.due) : lasting.due;
    }
  }
  return next;
}

void RuleWatch::tell(const Place& place, Time at, Values values, Moment now) {
  const Rule& rule = rules_[place.first];
  if (!quiet_.contains(place) && quiet_.size() >= most_remembered) {
    std::erase_if(quiet_, [&](const auto& one) { return one.second.until <= now.steady; });
  }
  if (!quiet_.contains(place) && !has_room(quiet_.size())) {
    return;
  }
  Quiet& quiet = quiet_[place];
  if (quiet.until > now.steady) {
    ++quiet.unsaid;
    lines_.push_back(fmt::format("rule {}: no mail about {}: the last one was less than {} s ago",
                                 rule.name, place.second,
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
