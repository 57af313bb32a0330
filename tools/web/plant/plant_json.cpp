// The JSON objects of PlantModel.
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::plant {

namespace {

double in_ms(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

void put_duration(boost::json::object& out, const char* name,
                  const std::optional<std::chrono::nanoseconds>& duration) {
  if (duration) {
    out[name] = in_ms(*duration);
  }
}

boost::json::object json_of(const fabric::plant::Program& program) {
  using enum fabric::plant::Program::State;
  boost::json::object out{{"state", program.state == aborted   ? "aborted"
                                    : program.state == on_hold ? "on hold"
                                                               : "running"},
                          {"name", print::text_json(program.event.program)}};
  if (program.event.error != 0) {
    out["error"] = program.event.error;
  }
  print::put_time(out, "since", program.event.at);
  return out;
}

boost::json::object json_of(const fabric::plant::ChannelView& view) {
  boost::json::object out{{"call", view.call},
                          {"call_level", name_of(view.call_level)},
                          {"state", view.state},
                          {"level", name_of(view.level)}};
  print::put_time(out, "since", view.since);
  return out;
}

}  // namespace

bool PlantModel::is_former(const fabric::MachineStatus& status) const {
  return status.gone && live_.has_gateway(status.machine);
}

bool PlantModel::has_another_gateway(const fabric::MachineStatus& status) const {
  const auto known = live_.machines().lower_bound({status.machine, {}});
  const bool had_one = known != live_.machines().end() && known->first.first == status.machine;
  return had_one && !status.gone &&
         fabric::plant::link_of(live_, status.machine) != fabric::plant::Link::up &&
         !live_.machines().contains({status.machine, status.gateway});
}

std::string PlantModel::name_of_service(const std::string& uuid) const {
  const std::string canonical = fabric::canonical_uuid(uuid);
  const std::string* name = nullptr;
  for (const auto& [id, instance] : live_.instances()) {
    if (instance.identity.uuid != canonical) {
      continue;
    }
    if (name != nullptr && *name != instance.identity.name) {
      return {};
    }
    name = &instance.identity.name;
  }
  if (name == nullptr) {
    const auto known = service_names_.find(canonical);
    name = known == service_names_.end() ? nullptr : &known->second;
  }
  return name == nullptr ? std::string() : print::utf8(*name);
}

boost::json::object PlantModel::channel_json(const fabric::ChannelStatus& status,
                                             const fabric::Moment& now) const {
  boost::json::object out = print::json_of(status);
  const fabric::plant::ChannelView view = fabric::plant::view_of(live_, status, now.wall);
  out["view"] = plant::json_of(view);
  print::put_message(out, "reason", view.why);
  if (const auto instance = live_.instances().find(status.instance);
      instance != live_.instances().end()) {
    out["name"] = print::utf8(instance->second.identity.name);
    out["host"] = print::utf8(instance->second.identity.host);
    out["service"] = out["name"];
  } else if (!status.uuid.empty()) {
    if (const std::string name = name_of_service(status.uuid); !name.empty()) {
      out["service"] = name;
    }
  }
  if (!status.uuid.empty()) {
    out["instances"] = live_.instances_for(status.uuid, status.key);
  }
  const recording::Call* const call = calls_.under_way(status.key);
  const recording::Step* const seen =
      call != nullptr && call->id == status.call ? call->first(recording::Stage::seen) : nullptr;
  if (seen != nullptr) {
    out["request"] = print::text_json(seen->text);
    out["request_state"] = seen->state;
    print::put_time(out, "seen", seen->at);
  } else if (const auto left = left_.find(status.key);
             status.state == fabric::ChannelState::unserved && status.call == fabric::CallId{} &&
             left != left_.end() && left->second.uuid == status.uuid) {
    out["request"] = print::text_json(left->second.text);
    out["request_state"] = left->second.state;
  }
  if (const auto* const program = live_.program_of(status.key)) {
    out["program"] = plant::json_of(*program);
  }
  const auto throughput = channel_pace_.find(status.key);
  const Figures figures = throughput == channel_pace_.end()
                              ? Figures{}
                              : throughput->second.figures(now.steady, counting_since_);
  out["calls_per_second"] = figures.per_second;
  put_duration(out, "recent_mean_ms", figures.mean);
  return out;
}

boost::json::object PlantModel::service_json(const fabric::plant::KnownInstance& instance,
                                             const fabric::Moment& now) const {
  boost::json::object out = print::json_of(instance.identity, instance.status);
  const auto throughput = instance_pace_.find(instance.identity.id);
  const Figures figures = throughput == instance_pace_.end()
                              ? Figures{}
                              : throughput->second.figures(now.steady, counting_since_);
  out["calls_per_second"] = figures.per_second;
  out["errors_last_minute"] = figures.errors_last_minute;
  put_duration(out, "p50_ms", figures.p50);
  put_duration(out, "p99_ms", figures.p99);
  const auto others = other_states_of_.find(instance.identity.id);
  out["other_states"] = others == other_states_of_.end() ? 0 : others->second;
  return out;
}

boost::json::object PlantModel::json_of(const EndedCall& ended) const {
  boost::json::object out = print::json_of(ended.call, ended.instance);
  out["failed"] = ended.failed;
  out["result"] = ended.result();
  // The name at the time of the call; the UUID may have another service now.
  const std::string name = ended.instance.name.empty() ? name_of_service(ended.call.uuid)
                                                       : print::utf8(ended.instance.name);
  if (!name.empty()) {
    out["service"] = name;
  }
  return out;
}

boost::json::object PlantModel::totals(const fabric::Moment& now) const {
  const Figures figures = throughput_.figures(now.steady, counting_since_);
  boost::json::object out{{"calls", ended_},
                          {"failed", failed_},
                          {"other_states", other_states_},
                          {"calls_per_second", figures.per_second},
                          {"errors_last_minute", figures.errors_last_minute},
                          {"delivered", counts_.delivered},
                          {"lost", counts_.lost},
                          {"services", live_.instances().size()},
                          {"machines", live_.machines().size()},
                          {"channels", live_.channels().size()},
                          {"data_groups", data_.groups()},
                          {"data_left_out", data_.left_out()},
                          {"program_channels", programs_.channels()}};
  put_duration(out, "p50_ms", figures.p50);
  put_duration(out, "p99_ms", figures.p99);
  return out;
}

boost::json::object PlantModel::about(const fabric::Moment& now) const {
  boost::json::object out{{"version", about_.version},
                          {"host", print::utf8(about_.host)},
                          {"fabric", print::utf8(about_.fabric)},
                          {"domain", about_.domain},
                          {"flags", print::utf8(about_.flags)},
                          {"recordings", about_.recordings},
                          {"actions", about_.actions}};
  print::put_time(out, "started", about_.started);
  print::put_time(out, "time", now.wall);
  return out;
}

boost::json::array PlantModel::machines() const {
  boost::json::array out;
  for (const auto& [key, status] : live_.machines()) {
    if (is_former(status)) {
      continue;
    }
    out.push_back(machine_json(status));
  }
  return out;
}

/// For a machine that is gone, only its name and the place of its last heartbeat remain.
boost::json::object PlantModel::machine_json(const fabric::MachineStatus& status) const {
  boost::json::object machine;
  print::put_fields(machine, status);
  if (const fabric::MachineStatus* last = live_.last_sample(status); status.gone && last) {
    machine["last_gateway_host"] = print::utf8(last->host);
    machine["last_gateway_pid"] = last->pid;
    machine["last_gateway_journal"] = fabric::name_of(last->journal);
  }
  return machine;
}

boost::json::array PlantModel::channels(const fabric::Moment& now) const {
  boost::json::array out;
  for (const auto& [key, status] : live_.channels()) {
    out.push_back(channel_json(status, now));
  }
  return out;
}

boost::json::array PlantModel::services(const fabric::Moment& now) const {
  boost::json::array out;
  for (const auto& [id, instance] : live_.instances()) {
    out.push_back(service_json(instance, now));
  }
  for (const auto& [id, gone] : live_.gone()) {
    boost::json::object instance = service_json(gone.last, now);
    print::put_time(instance, "gone", gone.at);
    out.push_back(std::move(instance));
  }
  return out;
}

boost::json::array PlantModel::alarms() const {
  boost::json::array out;
  for (const auto& [key, alarm] : live_.alarms()) {
    out.push_back(print::json_of(alarm));
  }
  return out;
}

std::vector<fabric::plant::Concern> PlantModel::concerns(const fabric::Moment& now) const {
  return fabric::plant::assess(live_, now.wall, {.flags = about_.flags});
}

boost::json::object PlantModel::calls(const CallFilter& filter, std::size_t most) const {
  boost::json::array list;
  for (const EndedCall* call : calls_.list(filter, most)) {
    list.push_back(json_of(*call));
  }
  boost::json::object out{{"calls", std::move(list)}, {"kept", calls_.size()}};
  if (const EndedCall* oldest = calls_.oldest()) {
    print::put_time(out, "oldest", oldest->call.end()->at);
  }
  return out;
}

boost::json::object PlantModel::snapshot(const fabric::Moment& now) const {
  return {{"about", about(now)},
          {"machines", machines()},
          {"channels", channels(now)},
          {"services", services(now)},
          {"concerns", print::json_of(concerns(now))},
          {"acknowledged", acknowledged_},
          {"calls", calls({}, calls_in_snapshot).at("calls")},
          {"totals", totals(now)},
          {"events", events_.list(events_in_snapshot)}};
}

}  // namespace millrace::tools::web::plant
