#include "tools/web/plant/plant_model.hpp"

#include <algorithm>
#include <utility>

#include "fabric/channel_scope.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

/// Names of services that are gone are kept for calls that refer to them; this is the limit.
constexpr std::size_t most_names = 4'096;
/// Pause between updates of figures that change all the time.
constexpr auto pause_of_figures = std::chrono::seconds(1);

bool goes_by_itself(fabric::ChannelState state) {
  return state == fabric::ChannelState::idle || state == fabric::ChannelState::running ||
         state == fabric::ChannelState::answering;
}

}  // namespace

const EndedCall* PlantModel::add(const recording::Entry& entry, const fabric::Moment& now) {
  if (auto event = fabric::plant::event_of(entry, live_)) {
    events_.add(std::move(*event));
  }
  if (const auto* sample = std::get_if<fabric::DataSample>(&entry.sample)) {
    data_.add(*sample, entry.at);
    return nullptr;
  }
  if (const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
    live_.add(entry);
    programs_.add(*event, entry.at);
    channels_changed_.insert(event->key);
    return nullptr;
  }
  if (const auto* news = std::get_if<recording::AlarmNews>(&entry.sample)) {
    live_.add(entry);
    mark_all_of_gateway(news->alarm.key.responder);
    return nullptr;
  }
  const auto* const machine = std::get_if<fabric::MachineStatus>(&entry.sample);
  const bool begins_again = machine != nullptr && has_another_gateway(*machine);
  live_.add(entry);
  const EndedCall* ended = calls_.add(entry);
  if (ended != nullptr) {
    add_ended(*ended, now);
  }
  if (const auto* channel = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    channels_changed_.insert(channel->key);
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    if (event->kind == fabric::EventKind::unserved && event->call == fabric::CallId{} &&
        live_.channels().contains(event->key)) {
      left_.insert_or_assign(event->key, *event);
      channels_changed_.insert(event->key);
    }
  } else if (machine != nullptr) {
    add_link(*machine, begins_again, entry.at);
  } else if (const auto* status = std::get_if<fabric::InstanceStatus>(&entry.sample)) {
    if (live_.instances().contains(status->instance)) {
      services_changed_.insert(status->instance);
    }
  } else if (const auto* news = std::get_if<recording::InstanceNews>(&entry.sample)) {
    add_news(*news);
  }
  return ended;
}

void PlantModel::acknowledge(Acknowledgement acknowledgement, fabric::Time at) {
  const auto same = std::ranges::find_if(acknowledged_, [&](const boost::json::value& each) {
    return each.at("cause").as_string() == acknowledgement.cause;
  });
  if (same != acknowledged_.end()) {
    acknowledged_.erase(same);
  } else if (acknowledged_.size() == most_acknowledged) {
    acknowledged_.erase(acknowledged_.begin());
  }
  boost::json::object out{{"cause", acknowledgement.cause},
                          {"since", acknowledgement.since},
                          {"by", print::utf8(acknowledgement.by)},
                          {"note", acknowledgement.note}};
  print::put_message(out, "name", acknowledgement.name);
  print::put_time(out, "time", at);
  acknowledged_.push_back(std::move(out));
  acknowledged_changed_ = true;
  const std::string& note = acknowledgement.note;
  events_.add({.at = at,
               .kind = fabric::plant::PlantEvent::Kind::acknowledged,
               .name = acknowledgement.name,
               .text = note.empty() ? acknowledgement.by : acknowledgement.by + ": " + note});
}

fabric::Message PlantModel::subject_of(const std::string& cause, const fabric::Moment& now) const {
  const std::vector<fabric::plant::Concern> all = concerns(now);
  const auto found = std::ranges::find(all, cause, &fabric::plant::Concern::cause);
  return found == all.end() ? fabric::Message() : fabric::plant::subject_of(*found);
}

bool PlantModel::forget(const std::vector<std::string>& machines, const std::string& by,
                        fabric::Time at) {
  const std::vector<fabric::plant::LostMachine> lost = live_.lost();
  const bool all_lost = std::ranges::all_of(machines, [&](const std::string& machine) {
    return std::ranges::any_of(lost,
                               [&](const auto& each) { return each.last.machine == machine; });
  });
  if (!all_lost) {
    return false;
  }
  for (const std::string& machine : machines) {
    // Before the plant forgets which gateways it had.
    mark_all_of(machine);
    live_.forget_machine(machine);
  }
  events_.add({.at = at,
               .kind = fabric::plant::PlantEvent::Kind::machine_forgotten,
               .machines = machines,
               .text = by});
  return true;
}

/// The gateway may have published why it leaves its machines' calls alone.
void PlantModel::mark_all_of_gateway(const fabric::InstanceId& gateway) {
  for (const auto& [key, status] : live_.machines()) {
    if (key.second == gateway) {
      mark_all_of(status.machine);
    }
  }
}

void PlantModel::add_link(const fabric::MachineStatus& status, bool begins_again,
                          fabric::Time received) {
  mark_all_of(status.machine);
  // Also a machine that was removed.
  machines_changed_.insert({status.machine, status.gateway});
  if (fabric::plant::link_of(live_, status.machine) == fabric::plant::Link::gone) {
    data_.silence(status.machine, received);
    programs_.silence(status.machine);
  } else {
    data_.end_silence(status.machine, !begins_again, received);
    if (!begins_again) {
      programs_.end_silence(status.machine);
    }
  }
}

void PlantModel::add_news(const recording::InstanceNews& news) {
  const fabric::InstanceId& id = news.identity.id;
  mark_callers_of(news);
  if (fabric::observer::is_absent(news.change)) {
    services_changed_.erase(id);
    services_gone_.insert(id);
    instance_pace_.erase(id);
    other_states_of_.erase(id);
    moving_instances_.erase(id);
    return;
  }
  services_gone_.erase(id);
  services_changed_.insert(id);
  if (service_names_.size() < most_names || service_names_.contains(news.identity.uuid)) {
    service_names_.insert_or_assign(news.identity.uuid, news.identity.name);
  }
}

/// Marks the channels whose calls need this service: the number of its instances has changed.
void PlantModel::mark_callers_of(const recording::InstanceNews& news) {
  const auto gone = live_.gone().find(news.identity.id);
  const std::string& uuid = fabric::observer::is_absent(news.change) && gone != live_.gone().end()
                                ? gone->second.last.identity.uuid
                                : news.identity.uuid;
  for (const auto& [key, status] : live_.channels()) {
    if (!status.uuid.empty() && fabric::canonical_uuid(status.uuid) == uuid) {
      channels_changed_.insert(key);
    }
  }
}

void PlantModel::add_ended(const EndedCall& ended, const fabric::Moment& now) {
  const recording::Call& call = ended.call;
  const fabric::InstanceId instance = call.instance();
  if (ended_ == 0) {
    counting_since_ = now.steady;
  }
  ++ended_;
  failed_ += ended.failed ? 1U : 0U;
  other_states_ += ended.other_state ? 1U : 0U;
  const auto duration = call.duration();
  // A call that the NC program gave up, or an operator answered, is no error of the service.
  const bool is_error = call.outcome() == recording::Outcome::failed;
  throughput_.add(now.steady, duration, is_error);
  channel_pace_[call.key].add(now.steady, duration, is_error);
  moving_channels_.insert(call.key);
  if (live_.instances().contains(instance)) {
    instance_pace_[instance].add(now.steady, duration, is_error);
    moving_instances_.insert(instance);
    if (ended.other_state) {
      ++other_states_of_[instance];
    }
  }
  history_.add_call(call.uuid, instance, call.key, duration, is_error);
  calls_ended_.push_back(call.id);
}

void PlantModel::mark_all_of(const std::string& machine) {
  for (auto link = live_.machines().lower_bound({machine, {}});
       link != live_.machines().end() && link->first.first == machine; ++link) {
    machines_changed_.insert(link->first);
  }
  for (auto channel = live_.channels().lower_bound({machine, 0});
       channel != live_.channels().end() && channel->first.machine.starts_with(machine);
       ++channel) {
    // Also the channels of its message queues, "cnc.ALARMS".
    if (fabric::machine_of(channel->first.machine) == machine) {
      channels_changed_.insert(channel->first);
    }
  }
}

void PlantModel::mark_what_moves(const fabric::Moment& now) {
  if (moved_ && now.steady - *moved_ < pause_of_figures) {
    return;
  }
  moved_ = now.steady;
  channels_changed_.insert(moving_channels_.begin(), moving_channels_.end());
  services_changed_.insert(moving_instances_.begin(), moving_instances_.end());
  std::erase_if(moving_channels_, [&](const fabric::ChannelKey& key) {
    return !channel_pace_[key].is_moving(now.steady);
  });
  std::erase_if(moving_instances_, [&](const fabric::InstanceId& id) {
    return !instance_pace_[id].is_moving(now.steady);
  });
}

void PlantModel::end_steps(const fabric::Moment& now) {
  if (!stepped_) {
    stepped_ = now.steady;
  }
  for (; now.steady - *stepped_ >= History::step_length; *stepped_ += History::step_length) {
    std::map<fabric::InstanceId, std::uint32_t> running;
    for (const auto& [id, instance] : live_.instances()) {
      running.emplace(id, instance.status ? instance.status->running : 0);
    }
    history_.step(now.wall, running);
  }
}

bool PlantModel::may_wait(const fabric::ChannelKey& key, const fabric::Moment& now) const {
  const auto channel = live_.channels().find(key);
  const auto sent = channels_sent_.find(key);
  return channel != live_.channels().end() && goes_by_itself(channel->second.state) &&
         sent != channels_sent_.end() && now.steady - sent->second.at < pause_of_a_busy_channel;
}

boost::json::array PlantModel::mark_views(const fabric::Moment& now) {
  boost::json::array gone;
  std::erase_if(channels_sent_, [&](const auto& sent) {
    const auto channel = live_.channels().find(sent.first);
    if (channel == live_.channels().end()) {
      gone.push_back(boost::json::object{{"machine", print::utf8(sent.first.machine)},
                                         {"channel", sent.first.channel}});
      return true;
    }
    if (view_of(live_, channel->second, now.wall) != sent.second.view) {
      channels_changed_.insert(sent.first);
    }
    return false;
  });
  return gone;
}

boost::json::object PlantModel::greeting(const fabric::Moment& now) {
  greeted_ = true;
  return snapshot(now);
}

std::optional<boost::json::object> PlantModel::changes(const fabric::Moment& now) {
  end_steps(now);
  mark_what_moves(now);
  data_.forget_old(now.wall);
  live_.forget_gone(now.wall - kept_gone);
  boost::json::array channels_gone = mark_views(now);
  std::vector<fabric::plant::Concern> concerns_now = concerns(now);
  const bool concerns_changed = std::exchange(greeted_, false) || concerns_now != concerns_sent_;
  boost::json::array machines;
  boost::json::array machines_gone;
  for (const MachineKey& key : machines_changed_) {
    const auto status = live_.machines().find(key);
    if (status == live_.machines().end() || is_former(status->second)) {
      machines_gone.push_back(boost::json::object{{"machine", print::utf8(key.first)},
                                                  {"gateway", key.second.to_string()}});
    } else {
      machines.push_back(machine_json(status->second));
    }
  }
  machines_changed_.clear();
  boost::json::array channels;
  std::erase_if(channels_changed_, [&](const fabric::ChannelKey& key) {
    const auto channel = live_.channels().find(key);
    if (channel == live_.channels().end()) {
      return true;  // A tool called in the name of a channel that no gateway has published.
    }
    if (may_wait(key, now)) {
      return false;
    }
    channels.push_back(channel_json(channel->second, now));
    channels_sent_.insert_or_assign(
        key, SentChannel{now.steady, view_of(live_, channel->second, now.wall)});
    return true;
  });
  boost::json::array services;
  for (const fabric::InstanceId& id : services_changed_) {
    services.push_back(service_json(live_.instances().at(id), now));
  }
  services_changed_.clear();
  boost::json::array gone;
  for (const fabric::InstanceId& id : services_gone_) {
    gone.emplace_back(id.to_string());
  }
  services_gone_.clear();
  std::uint64_t skipped = 0;
  boost::json::array calls = take_calls(skipped);

  const bool is_news = !machines.empty() || !channels.empty() || !services.empty() ||
                       !gone.empty() || !channels_gone.empty() || !calls.empty() ||
                       concerns_changed || acknowledged_changed_ || events_.has_news();
  if (!is_news && published_at_ && now.steady - *published_at_ < heartbeat) {
    return std::nullopt;
  }
  published_at_ = now.steady;
  boost::json::object out{{"totals", totals(now)}};
  print::put_time(out, "time", now.wall);
  const auto put = [&](const char* name, boost::json::array&& list) {
    if (!list.empty()) {
      out[name] = std::move(list);
    }
  };
  put("machines", std::move(machines));
  put("channels", std::move(channels));
  put("services", std::move(services));
  put("calls", std::move(calls));
  put("events", events_.take());
  if (concerns_changed) {
    // All of them: there are few, and a page that missed a removal would show one for ever.
    out["concerns"] = print::json_of(concerns_now);
    concerns_sent_ = std::move(concerns_now);
  }
  if (std::exchange(acknowledged_changed_, false)) {
    out["acknowledged"] = acknowledged_;
  }
  boost::json::object parted;
  if (!gone.empty()) {
    parted["services"] = std::move(gone);
  }
  if (!machines_gone.empty()) {
    parted["machines"] = std::move(machines_gone);
  }
  if (!channels_gone.empty()) {
    parted["channels"] = std::move(channels_gone);
  }
  if (!parted.empty()) {
    out["gone"] = std::move(parted);
  }
  if (skipped > 0) {
    out["skipped"] = skipped;
  }
  return out;
}

boost::json::array PlantModel::take_calls(std::uint64_t& skipped) {
  std::vector<const EndedCall*> ended;
  for (const fabric::CallId& id : calls_ended_) {
    if (const EndedCall* call = calls_.ended(id)) {
      ended.push_back(call);
    }
  }
  calls_ended_.clear();
  if (ended.size() > calls_in_change) {
    skipped = ended.size() - calls_in_change;
    // Failed calls and those with another state first, then the newest of the others.
    std::ranges::reverse(ended);
    std::ranges::stable_partition(
        ended, [](const EndedCall* call) { return call->failed || call->other_state; });
    ended.resize(calls_in_change);
    std::ranges::stable_sort(ended, {}, [](const EndedCall* call) { return call->call.end()->at; });
  }
  boost::json::array calls;
  for (const EndedCall* call : ended) {
    calls.push_back(json_of(*call));
  }
  return calls;
}

}  // namespace millrace::tools::web::plant
