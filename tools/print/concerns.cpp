#include "tools/print/concerns.hpp"

#include "tools/print/json.hpp"

namespace millrace::tools::print {

boost::json::object json_of(const fabric::plant::Concern& concern) {
  boost::json::object out{{"kind", name_of(concern.kind)},
                          {"level", name_of(concern.level)},
                          {"who", name_of(concern.who)}};
  put_message(out, "subject", subject_of(concern));
  if (!concern.machines.empty()) {
    boost::json::array machines;
    for (const std::string& machine : concern.machines) {
      machines.emplace_back(utf8(machine));
    }
    out["machines"] = std::move(machines);
  }
  if (!concern.channels.empty()) {
    boost::json::array channels;
    for (const fabric::ChannelKey& key : concern.channels) {
      channels.push_back(
          boost::json::object{{"machine", utf8(key.machine)}, {"channel", key.channel}});
    }
    out["channels"] = std::move(channels);
  }
  if (!concern.uuid.empty()) {
    out["uuid"] = utf8(concern.uuid);
  }
  put_time(out, "since", concern.since);
  put_message(out, "what", concern.what);
  if (!concern.why.empty()) {
    put_message(out, "why", concern.why);
  }
  out["todo"] = json_of(concern.todo);
  out["cause"] = utf8(concern.cause);
  return out;
}

boost::json::array json_of(const std::vector<fabric::Message>& steps) {
  boost::json::array out;
  for (const fabric::Message& step : steps) {
    boost::json::object each;
    put_message(each, "text", step);
    out.push_back(std::move(each));
  }
  return out;
}

boost::json::array json_of(const std::vector<fabric::plant::Concern>& concerns) {
  boost::json::array out;
  for (const fabric::plant::Concern& concern : concerns) {
    out.push_back(json_of(concern));
  }
  return out;
}

}  // namespace millrace::tools::print
