#include "tools/web/plant/program_store.hpp"

#include <algorithm>

#include "tools/print/data.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

using fabric::ProgramEvent;
using fabric::ProgramEventKind;

bool is_end(ProgramEventKind kind) {
  return kind == ProgramEventKind::ended || kind == ProgramEventKind::aborted ||
         kind == ProgramEventKind::reset;
}

}  // namespace

void ProgramStore::add(const ProgramEvent& event, fabric::Time received) {
  const auto known = channels_.find(event.key);
  if (known == channels_.end() && channels_.size() >= limits_.channels) {
    // The channel that is silent for longest makes room.
    channels_.erase(std::ranges::min_element(
        channels_, {}, [](const auto& each) { return each.second.received; }));
  }
  Channel& channel = channels_[event.key];
  channel.last = event;
  channel.received = received;
  if (is_about_an_aborted_run(channel, event)) {
    return;
  }
  Run& run = run_of(channel, event);
  // Fields that an event leaves out keep their values.
  ProgramEvent stored = event;
  if (stored.program.empty()) {
    stored.program = run.event.program;
  }
  if (!stored.parts) {
    stored.parts = run.event.parts;
  }
  run.event = std::move(stored);
  run.is_unknown = false;
  if (is_end(event.kind)) {
    run.ended = event.at;
  }
  if (!run.holds.empty() && !run.holds.back().to) {
    run.holds.back().to = event.at;
  }
  if (event.kind == ProgramEventKind::on_hold) {
    run.holds.push_back({.from = event.at});
    if (run.holds.size() > limits_.holds) {
      run.holds.pop_front();
    }
  }
}

/// The event reports about an aborted run: its error is cleared, or a gateway has found it.
bool ProgramStore::is_about_an_aborted_run(Channel& channel, const ProgramEvent& event) {
  if (channel.runs.empty() || channel.runs.back().event.kind != ProgramEventKind::aborted) {
    return false;
  }
  Run& run = channel.runs.back();
  const bool is_of_it = event.started == fabric::Time{} || event.started == run.event.started;
  if (event.kind == ProgramEventKind::reset && is_of_it) {
    run.is_cleared = true;
    return true;
  }
  if (event.kind == ProgramEventKind::aborted && event.started == fabric::Time{} &&
      !run.is_cleared) {
    return true;
  }
  return false;
}

ProgramStore::Run& ProgramStore::run_of(Channel& channel, const ProgramEvent& event) const {
  std::deque<Run>& runs = channel.runs;
  const bool goes_on = !runs.empty() && !runs.back().ended &&
                       event.kind != ProgramEventKind::started &&
                       runs.back().event.started == event.started;
  // A gateway repeats its last event for a new reader.
  const bool is_told_again = !runs.empty() && runs.back().event.kind == event.kind &&
                             runs.back().event.started == event.started &&
                             runs.back().event.at == event.at;
  if (goes_on || is_told_again) {
    return runs.back();
  }
  if (!runs.empty() && !runs.back().ended) {
    // Its end was not published.
    runs.back().is_unknown = true;
  }
  runs.emplace_back();
  if (runs.size() > limits_.runs) {
    runs.pop_front();
  }
  return runs.back();
}

template <typename Change>
void ProgramStore::for_last_run(const std::string& machine, const Change& change) {
  for (auto channel = channels_.lower_bound({machine, 0});
       channel != channels_.end() && channel->first.machine == machine; ++channel) {
    if (!channel->second.runs.empty()) {
      change(channel->second.runs.back());
    }
  }
}

void ProgramStore::silence(const std::string& machine) {
  for_last_run(machine, [](Run& run) { run.is_unknown = !run.ended; });
}

void ProgramStore::end_silence(const std::string& machine) {
  for_last_run(machine, [](Run& run) { run.is_unknown = false; });
}

void ProgramStore::add_machines(std::set<std::string>& names) const {
  for (const auto& [key, channel] : channels_) {
    names.insert(key.machine);
  }
}

bool ProgramStore::takes(const ProgramFilter& filter, const fabric::ChannelKey& key) {
  return (filter.machine.empty() || filter.machine == key.machine) &&
         (filter.channel == 0 || filter.channel == key.channel);
}

boost::json::array ProgramStore::last(const ProgramFilter& filter) const {
  boost::json::array out;
  for (const auto& [key, channel] : channels_) {
    if (takes(filter, key)) {
      boost::json::object event;
      print::put_time(event, "time", channel.received);
      event["kind"] = "program";
      print::put_program(event, channel.last);
      out.push_back(std::move(event));
    }
  }
  return out;
}

boost::json::object ProgramStore::json_of(const Run& run) {
  const ProgramEvent& event = run.event;
  boost::json::object out;
  print::put_program(out, event);
  // "event" and "at" belong to the last event; a run has a state and an end.
  out.erase("event");
  out.erase("at");
  if (!run.ended) {
    out.erase("duration_s");
  }
  out["state"] = run.ended                                 ? fabric::name_of(event.kind)
                 : run.is_unknown                          ? "unknown"
                 : event.kind == ProgramEventKind::on_hold ? "on hold"
                                                           : "running";
  print::put_time(out, "told", event.at);
  if (run.ended) {
    print::put_time(out, "ended", *run.ended);
  }
  boost::json::array holds;
  for (const Hold& hold : run.holds) {
    boost::json::object time;
    print::put_time(time, "from", hold.from);
    if (hold.to) {
      print::put_time(time, "to", *hold.to);
    }
    holds.push_back(std::move(time));
  }
  out["holds"] = std::move(holds);
  return out;
}

boost::json::object ProgramStore::runs(const ProgramFilter& filter, std::size_t most) const {
  std::vector<const Run*> found;
  for (const auto& [key, channel] : channels_) {
    if (takes(filter, key)) {
      std::ranges::transform(channel.runs, std::back_inserter(found),
                             [](const Run& run) { return &run; });
    }
  }
  const auto begun = [](const Run* run) {
    return run->event.started == fabric::Time{} ? run->event.at : run->event.started;
  };
  std::ranges::stable_sort(found, std::ranges::greater(), begun);
  boost::json::array list;
  for (const Run* run : found) {
    if (list.size() == most) {
      break;
    }
    list.push_back(json_of(*run));
  }
  const bool more = list.size() < found.size();
  return {{"runs", std::move(list)}, {"more", more}};
}

}  // namespace millrace::tools::web::plant
