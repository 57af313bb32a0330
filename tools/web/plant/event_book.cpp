#include "tools/web/plant/event_book.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/messages/catalogue.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

/// All machines of a gateway disappear within this time.
constexpr auto gateway_goes_within = std::chrono::seconds(30);

boost::json::object json_of(const PlantEvent& event) {
  boost::json::object out{{"number", event.number}, {"kind", event.kind}};
  print::put_time(out, "time", event.at);
  boost::json::array machines;
  for (const std::string& machine : event.machines) {
    machines.emplace_back(print::utf8(machine));
  }
  if (!machines.empty()) {
    out["machines"] = std::move(machines);
  }
  if (event.channel != 0) {
    out["channel"] = event.channel;
  }
  if (event.call != fabric::CallId{}) {
    out["call"] = event.call.to_string();
  }
  const auto put = [&](const char* name, const std::string& text) {
    if (!text.empty()) {
      out[name] = print::utf8(text);
    }
  };
  put("uuid", event.uuid);
  put("name", event.name);
  put("host", event.host);
  if (!event.text.empty()) {
    print::put_message(out, "text", event.text);
  }
  if (event.pid != 0) {
    out["pid"] = event.pid;
  }
  if (event.error != 0) {
    out["error"] = event.error;
  }
  if (event.last) {
    out["last"] = true;
  }
  return out;
}

}  // namespace

void EventBook::add(const recording::Entry& entry, const fabric::plant::Plant& live) {
  std::visit([&](const auto& sample) { add(sample, entry.at, live); }, entry.sample);
}

void EventBook::add(const recording::InstanceNews& news, fabric::Time at,
                    const fabric::plant::Plant& live) {
  using enum recording::Change;
  const auto there = live.instances().find(news.identity.id);
  const auto absent = live.gone().find(news.identity.id);
  const bool was_silent = absent != live.gone().end() && absent->second.silent;
  const bool was_there = there != live.instances().end();
  if (fabric::observer::is_absent(news.change) ? !was_there && !(was_silent && news.change == gone)
                                               : !was_silent) {
    return;
  }
  // The news about an instance that is gone or silent has nothing but its id.
  const fabric::InstanceIdentity& of =
      was_there ? there->second.identity : absent->second.last.identity;
  const auto others = std::ranges::count_if(live.instances(), [&](const auto& each) {
    return each.second.identity.uuid == of.uuid && each.first != of.id;
  });
  put({.at = at,
       .kind = news.change == gone     ? "instance ended"
               : news.change == silent ? "instance silent"
                                       : "instance responds",
       .uuid = of.uuid,
       .name = of.name,
       .host = of.host,
       .pid = of.pid,
       .who = of.id,
       .last = fabric::observer::is_absent(news.change) && others == 0});
}

/// The instance publishes its own start time, so this holds for those that are older than the
/// server.
void EventBook::add(const fabric::InstanceStatus& status, fabric::Time /*at*/,
                    const fabric::plant::Plant& live) {
  const auto known = live.instances().find(status.instance);
  if (known == live.instances().end() || known->second.status || status.started == fabric::Time{}) {
    return;
  }
  const fabric::InstanceIdentity& is = known->second.identity;
  put({.at = status.started,
       .kind = "instance started",
       .uuid = is.uuid,
       .name = is.name,
       .host = is.host,
       .pid = is.pid,
       .who = is.id});
}

void EventBook::add(const fabric::MachineStatus& status, fabric::Time at,
                    const fabric::plant::Plant& live) {
  const auto known = live.machines().find({status.machine, status.gateway});
  const bool is_known = known != live.machines().end();
  const bool was_heard = is_known && !known->second.gone;
  const auto is_silent = [](const fabric::MachineStatus& of) {
    return of.gone && base::messages::gateway_not_responding.is(of.reason);
  };
  const bool was_silent = is_known && is_silent(known->second);
  if (status.gone) {
    if (was_heard || (was_silent && !is_silent(status))) {
      const fabric::MachineStatus* const last = live.last_sample(status);
      put_gateway(base::messages::machine_removed.is(status.reason) ? "machine removed"
                  : is_silent(status)                               ? "gateway silent"
                                                                    : "gateway gone",
                  last == nullptr ? status : *last, at);
    }
    return;
  }
  if (was_silent) {
    put_gateway("gateway responds", status, at);
  } else if (!was_heard) {
    const auto any = live.machines().lower_bound({status.machine, {}});
    if (any != live.machines().end() && any->first.first == status.machine) {
      put_gateway("gateway started", status,
                  status.claimed == fabric::Time{} ? status.since : status.claimed);
    }
  }
  // A gateway that stands by has no connection and needs none.
  const bool has_another = std::ranges::any_of(live.machines(), [&](const auto& one) {
    return one.second.machine == status.machine && one.second.gateway != status.gateway &&
           one.second.connected;
  });
  // A gateway that has just started is about to connect: only a lost connection is news.
  if (!was_heard || status.connected == known->second.connected || has_another ||
      (status.connected && !was_reported_down(status))) {
    return;
  }
  put({.at = status.since,
       .kind = status.connected ? "link up" : "link down",
       .machines = {status.machine},
       .who = status.gateway,
       .text = status.connected ? fabric::Message() : status.reason});
}

bool EventBook::was_reported_down(const fabric::MachineStatus& status) const {
  const auto last = std::find_if(events_.rbegin(), events_.rend(), [&](const PlantEvent& each) {
    return each.who == status.gateway && each.kind.starts_with("link ") &&
           each.machines.front() == status.machine;
  });
  return last != events_.rend() && last->kind == "link down";
}

void EventBook::add(const fabric::ChannelStatus& status, fabric::Time /*at*/,
                    const fabric::plant::Plant& live) {
  const auto known = live.channels().find(status.key);
  const bool was_known = known != live.channels().end();
  const auto before = was_known ? known->second.state : fabric::ChannelState::idle;
  PlantEvent event{.at = status.since,
                   .machines = {status.key.machine},
                   .channel = status.key.channel,
                   .call = status.call,
                   .uuid = status.uuid};
  if (status.state == fabric::ChannelState::held && before != fabric::ChannelState::held) {
    event.kind = "call held";
    event.text = status.reason;
    put(std::move(event));
  } else if (base::messages::dispatched_again.is(status.reason) && was_known &&
             known->second.reason != status.reason) {
    event.kind = "call retried";
    event.text = status.reason.arguments.front();
    put(std::move(event));
  }
}

void EventBook::add(const fabric::Event& event, fabric::Time /*at*/,
                    const fabric::plant::Plant& /*live*/) {
  if (!base::messages::answered_by.is(event.detail) || event.replayed ||
      std::ranges::any_of(events_, [&](const PlantEvent& each) {
        return each.kind == "call answered" && each.call == event.call;
      })) {
    return;
  }
  put({.at = event.at,
       .kind = "call answered",
       .machines = {event.key.machine},
       .channel = event.key.channel,
       .call = event.call,
       .uuid = event.uuid,
       .text = event.detail.arguments.front()});
}

void EventBook::add(const fabric::ProgramEvent& event, fabric::Time /*at*/,
                    const fabric::plant::Plant& /*live*/) {
  // A new gateway repeats an error that still stands.
  if (event.kind != fabric::ProgramEventKind::aborted || event.replayed ||
      std::ranges::any_of(events_, [&](const PlantEvent& each) {
        return each.kind == "program aborted" && each.at == event.at &&
               each.machines.front() == event.key.machine && each.channel == event.key.channel;
      })) {
    return;
  }
  put({.at = event.at,
       .kind = "program aborted",
       .machines = {event.key.machine},
       .channel = event.key.channel,
       .name = print::text_json(event.program),
       .error = event.error});
}

void EventBook::add(const recording::AlarmNews& news, fabric::Time at,
                    const fabric::plant::Plant& live) {
  const auto known = live.alarms().find(news.alarm.key);
  if (news.over && news.lost && known != live.alarms().end() &&
      fabric::plant::says_that_it_runs(news.alarm.key)) {
    const fabric::Alarm& last = known->second;
    put({.at = at,
         .kind = "process gone",
         .name = last.program,
         .host = last.host,
         .pid = last.pid,
         .who = last.key.responder});
    return;
  }
  const bool was_problem =
      known != live.alarms().end() && known->second.level == fabric::AlarmLevel::problem;
  const bool is_problem = !news.over && news.alarm.level == fabric::AlarmLevel::problem;
  // The alarm about a lost service is shown with the instance that ended.
  if (was_problem == is_problem || news.alarm.key.kind == "service") {
    return;
  }
  const fabric::Alarm& said = is_problem ? news.alarm : known->second;
  put({.at = is_problem ? said.since : at,
       .kind = is_problem ? "problem" : "problem over",
       .name = said.program,
       .host = said.host,
       .pid = said.pid,
       .who = said.key.responder,
       .text = said.text});
}

void EventBook::add_acknowledgement(const std::string& name, const std::string& by,
                                    const std::string& note, fabric::Time at) {
  put({.at = at,
       .kind = "acknowledged",
       .name = name,
       .text = note.empty() ? by : by + ": " + note});
}

void EventBook::put_gateway(std::string_view kind, const fabric::MachineStatus& of,
                            fabric::Time at) {
  const auto same = std::ranges::find_if(events_, [&](const PlantEvent& each) {
    return each.kind == kind && each.who == of.gateway && at - each.at < gateway_goes_within &&
           std::ranges::find(each.machines, of.machine) == each.machines.end();
  });
  if (same == events_.end()) {
    put({.at = at,
         .kind = kind,
         .machines = {of.machine},
         .host = of.host,
         .pid = of.pid,
         .who = of.gateway});
  } else {
    same->machines.push_back(of.machine);
    news_.insert(same->number);
  }
}

void EventBook::put(PlantEvent event) {
  event.number = ++number_;
  news_.insert(event.number);
  const auto place = std::ranges::upper_bound(events_, event.at, {}, &PlantEvent::at);
  events_.insert(place, std::move(event));
  if (events_.size() > most_events) {
    news_.erase(events_.front().number);
    events_.pop_front();
  }
}

boost::json::array EventBook::list(std::size_t most) const {
  boost::json::array out;
  for (auto event = events_.rbegin(); event != events_.rend() && out.size() < most; ++event) {
    out.push_back(json_of(*event));
  }
  return out;
}

boost::json::array EventBook::take() {
  boost::json::array out;
  for (const PlantEvent& event : events_) {
    if (news_.contains(event.number)) {
      out.push_back(json_of(event));
    }
  }
  news_.clear();
  return out;
}

}  // namespace millrace::tools::web::plant
