#include "tools/print/json.hpp"

#include <cmath>

#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>
#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

void append(std::string& text, const boost::json::value& value) {
  if (const auto* const array = value.if_array()) {
    text += '[';
    for (const boost::json::value& each : *array) {
      text += &each == array->data() ? "" : ",";
      append(text, each);
    }
    text += ']';
  } else if (const auto* const object = value.if_object()) {
    text += '{';
    bool first = true;
    for (const auto& [key, each] : *object) {
      text += (first ? "" : ",") + boost::json::serialize(boost::json::string(key)) + ':';
      append(text, each);
      first = false;
    }
    text += '}';
  } else if (const auto* const number = value.if_double()) {
    text += std::isfinite(*number) ? fmt::format("{}", *number) : "null";
  } else {
    text += boost::json::serialize(value);
  }
}

}  // namespace

void put_time(boost::json::object& out, std::string_view name, fabric::Time time) {
  if (time != fabric::Time{}) {
    out[name] = time_text(time);
  }
}

void put_identity(boost::json::object& out, const fabric::InstanceIdentity& identity) {
  out["instance"] = identity.id.to_string();
  out["uuid"] = utf8(identity.uuid);
  out["name"] = utf8(identity.name);
  out["description"] = utf8(identity.description);
  out["version"] = utf8(identity.version);
  out["host"] = utf8(identity.host);
  out["pid"] = identity.pid;
  boost::json::array channels;
  for (const fabric::ChannelScope& scope : identity.channels) {
    channels.emplace_back(utf8(fabric::format_channel_scope(scope)));
  }
  out["channels"] = std::move(channels);
  out["delivery"] = name_of(identity.delivery);
  out["awaited"] = name_of(identity.awaited);
  out["concurrency"] = identity.concurrency;
  out["draining"] = identity.draining;
  if (!identity.certificate.empty()) {
    out["certificate"] = utf8(identity.certificate);
  }
}

void put_status(boost::json::object& out, const fabric::InstanceStatus& status) {
  out["running"] = status.running;
  out["waiting"] = status.waiting;
  out["answered_calls"] = status.answered;
  out["failed"] = status.failed;
  out["repeated"] = status.repeated;
  out["cancelled"] = status.cancelled;
  out["mean_ms"] = std::chrono::duration<double, std::milli>(status.mean).count();
  put_time(out, "started", status.started);
  put_time(out, "last_call", status.last_call);
}

bool is_pushed(const fabric::MachineStatus& status) {
  // It may stand behind other words: "channel 2 is served by another; pushed".
  return status.connected && status.reason.ends_with("pushed");
}

void put_machine(boost::json::object& out, const fabric::MachineStatus& status) {
  out["machine"] = utf8(status.machine);
  out["connected"] = status.connected;
  put_time(out, "since", status.since);
  out["address"] = utf8(status.address);
  out["reason"] = utf8(status.reason);
  out["channels"] = status.channels;
  out["poll_ms"] = std::chrono::duration<double, std::milli>(status.poll).count();
  out["pushed"] = is_pushed(status);
  out["requests_per_second"] = status.requests_per_second;
  out["round_trip_ms"] = std::chrono::duration<double, std::milli>(status.round_trip).count();
  out["gateway_host"] = utf8(status.host);
  out["gateway_pid"] = status.pid;
  out["gateway_version"] = utf8(status.version);
  out["gateway"] = status.gateway.to_string();
  out["gateway_epoch"] = fmt::format("{:x}", status.epoch);
  put_time(out, "claimed", status.claimed);
  out["claims"] = boost::json::array(status.claims.begin(), status.claims.end());
}

void put_channel(boost::json::object& out, const fabric::ChannelStatus& status) {
  out["channel_state"] = name_of(status.state);
  put_time(out, "since", status.since);
  out["attempt"] = status.attempt;
  if (status.instance != fabric::InstanceId{}) {
    out["instance"] = status.instance.to_string();
  }
  out["reason"] = utf8(status.reason);
  out["calls"] = status.calls;
  out["answered_calls"] = status.answered;
  out["withdrawn"] = status.withdrawn;
  out["repeated"] = status.repeated;
  out["late"] = status.late;
  out["failed"] = status.failed;
}

boost::json::object json_of(const fabric::ChannelStatus& status) {
  boost::json::object out{{"machine", utf8(status.key.machine)}, {"channel", status.key.channel}};
  if (status.call != fabric::CallId{}) {
    out["call"] = status.call.to_string();
  }
  if (!status.uuid.empty()) {
    out["uuid"] = utf8(status.uuid);
  }
  put_channel(out, status);
  return out;
}

boost::json::object json_of(const fabric::InstanceIdentity& identity,
                            const std::optional<fabric::InstanceStatus>& status) {
  boost::json::object out;
  put_identity(out, identity);
  if (status) {
    put_status(out, *status);
  }
  return out;
}

std::string text_json(std::string_view cp1252) {
  return base::text::to_utf8(cp1252);
}

std::string utf8(std::string_view text) {
  return base::text::is_utf8(text) ? std::string(text) : base::text::to_utf8(text);
}

std::string json_text(const boost::json::value& value) {
  std::string text;
  append(text, value);
  return text;
}

void print_json(const boost::json::value& value) {
  fmt::print("{}\n", json_text(value));
}

}  // namespace millrace::tools::print
