#include "tools/web/plant/event_book.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

using fabric::plant::PlantEvent;

/// All machines of a gateway disappear within this time.
constexpr auto gateway_goes_within = std::chrono::seconds(30);

bool is_of_gateway(PlantEvent::Kind kind) {
  using enum PlantEvent::Kind;
  return kind == gateway_started || kind == gateway_silent || kind == gateway_responds ||
         kind == gateway_gone || kind == machine_removed;
}

/// Two gateways report it, or one again.
bool is_same(const PlantEvent& known, const PlantEvent& event) {
  using enum PlantEvent::Kind;
  if (known.kind != event.kind) {
    return false;
  }
  return event.kind == call_answered
             ? known.call == event.call
             : event.kind == program_aborted && known.at == event.at &&
                   known.machines == event.machines && known.channel == event.channel;
}

}  // namespace

boost::json::object EventBook::json_of(const NumberedEvent& numbered) {
  const PlantEvent& event = numbered.event;
  boost::json::object out{{"number", numbered.number}, {"kind", name_of(event.kind)}};
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
  put("host", event.host);
  if (!event.name.empty()) {
    print::put_message(out, "name", event.name);
  }
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

void EventBook::add(PlantEvent event) {
  if (joins_known(event)) {
    return;
  }
  news_.insert(++number_);
  const auto place = std::ranges::upper_bound(
      events_, event.at, {}, [](const NumberedEvent& each) { return each.event.at; });
  events_.insert(place, {number_, std::move(event)});
  if (events_.size() > most_events) {
    news_.erase(events_.front().number);
    events_.pop_front();
  }
}

bool EventBook::joins_known(const PlantEvent& event) {
  for (NumberedEvent& known : events_) {
    if (is_same(known.event, event)) {
      return true;
    }
    std::vector<std::string>& machines = known.event.machines;
    if (is_of_gateway(event.kind) && known.event.kind == event.kind &&
        known.event.who == event.who && event.at - known.event.at < gateway_goes_within &&
        std::ranges::find(machines, event.machines.front()) == machines.end()) {
      machines.push_back(event.machines.front());
      news_.insert(known.number);
      return true;
    }
  }
  return false;
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
  for (const NumberedEvent& event : events_) {
    if (news_.contains(event.number)) {
      out.push_back(json_of(event));
    }
  }
  news_.clear();
  return out;
}

}  // namespace millrace::tools::web::plant
