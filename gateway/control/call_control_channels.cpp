// Which channels have a session: they come with the links, and leave when the configuration names
// them no more or another gateway serves them.
#include <utility>

#include "gateway/control/call_control.hpp"

namespace millrace::gateway::control {

namespace {

void add(CallCounts& counts, const fabric::ChannelStatus& status) {
  counts.answered += status.answered;
  counts.failed += status.failed;
  counts.withdrawn += status.withdrawn;
}

}  // namespace

CallCounts CallControl::counts() const {
  CallCounts counts = left_counts_;
  for (const auto& [key, session] : sessions_) {
    add(counts, session.status());
  }
  return counts;
}

channel::ChannelSession& CallControl::open(const fabric::ChannelKey& key) {
  std::shared_ptr<WriteEffects>& effects = effects_[key.machine];
  if (effects == nullptr) {
    effects = std::make_shared<WriteEffects>();
  }
  channel::ChannelSession& session =
      sessions_.try_emplace(key, key, context_, pace_of(key.machine), effects).first->second;
  index_[key] = &session;
  return session;
}

Pace CallControl::pace_of(const std::string& machine) const {
  const auto pace = options_.paces.find(machine);
  return pace == options_.paces.end() ? Pace{} : pace->second;
}

void CallControl::on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels,
                             Moment now) {
  for (const std::uint16_t channel : channels) {
    reserve_numbers();
    channel::ChannelSession& session = open({machine, channel});
    if (session.retired()) {
      leaving_.erase(session.key());
      session.keep(now);
      follow(session, now);
    }
    if (!session.link_up()) {
      session.on_link_up(now);
      follow(session, now);
    }
  }
  for (const fabric::ChannelKey& key : leaving_) {
    channel::ChannelSession& session = sessions_.at(key);
    if (key.machine == machine && !session.link_up()) {
      session.on_link_up(now);
      follow(session, now);
    }
  }
  finish();
}

/// When one of them frees an instance, another one gets it: none may then ask anything of the link.
void CallControl::lose_link(const std::string& machine) {
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      session.lose_link();
    }
  }
}

void CallControl::on_link_down(const std::string& machine, const std::string& reason, Moment now) {
  lose_link(machine);
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      session.on_link_down(reason, now);
      follow(session, now);
    }
  }
  finish();
}

void CallControl::on_link_dropped(const std::string& machine, const std::string& reason,
                                  Moment now) {
  lose_link(machine);
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      session.on_link_dropped(reason, now);
      follow(session, now);
    }
  }
  finish();
}

void CallControl::retire(const fabric::ChannelKey& key, Moment now) {
  if (channel::ChannelSession* session = find(key)) {
    leaving_.insert(key);
    session->retire(now);
    follow(*session, now);
  }
  finish();
}

void CallControl::release(const fabric::ChannelKey& key, const std::string& reason, Moment now) {
  if (channel::ChannelSession* session = find(key)) {
    leaving_.insert(key);
    if (session->may_be_given()) {
      // The other may never take it up before we serve the channel again.
      const Call* call = session->call();
      inherit(key, {call->request.uuid, "this gateway, which had left the channel to another one",
                    call->id});
    }
    session->hand_over(reason, now);
    follow(*session, now);
  }
  finish();
}

void CallControl::inherit(const fabric::ChannelKey& key, Inheritance inheritance) {
  const std::string uuid = fabric::canonical_uuid(inheritance.uuid);
  if (inheritance.call.epoch != epoch_) {
    context_.predecessors[key] = inheritance.call.epoch;
  }
  // A channel has one call at a time; a stranger may tell of any number, which only makes those
  // wait for an operator that are called next.
  constexpr std::size_t most_inherited = 64;
  auto& of_channel = inherited_[key];
  if (of_channel.size() < most_inherited || of_channel.contains(uuid)) {
    of_channel.insert_or_assign(uuid, std::move(inheritance));
  }
}

std::vector<std::uint16_t> CallControl::channels_of(const std::string& machine) const {
  std::vector<std::uint16_t> channels;
  for (const auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      channels.push_back(key.channel);
    }
  }
  return channels;
}

void CallControl::change(std::map<std::string, Pace> paces, Policies policies, Moment now) {
  options_.paces = std::move(paces);
  options_.policies = std::move(policies);
  for (auto& [key, session] : sessions_) {
    session.set_pace(pace_of(key.machine));
  }
  reconsider(now);
  finish();
}

void CallControl::set_interest(const Interest& interest, Moment now) {
  const Interest before = std::exchange(context_.interest, interest);
  if (interest.statuses && !before.statuses) {
    for (auto& [key, session] : sessions_) {
      session.show_again(now);
      follow(session, now);
    }
  }
  finish();
}

void CallControl::take_back(Moment now) {
  for (auto& [key, session] : sessions_) {
    session.let_go(now);
    follow(session, now);
  }
  dispose(context_.answered.take_all());
  finish();
}

void CallControl::finish() {
  for (auto it = leaving_.begin(); it != leaving_.end();) {
    if (sessions_.at(*it).is_over()) {
      dispose(context_.answered.take(*it));
      add(left_counts_, sessions_.at(*it).status());
      context_.port.dispose(*it);
      context_.standing.forget(*it);
      timers_.remove(*it);
      index_.erase(*it);
      context_.predecessors.erase(*it);
      sessions_.erase(*it);
      it = leaving_.erase(it);
    } else {
      ++it;
    }
  }
}

}  // namespace millrace::gateway::control
