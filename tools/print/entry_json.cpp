#include <boost/json/array.hpp>

#include "fabric/words.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/notice_text.hpp"

namespace millrace::tools::print {

namespace {

using recording::Entry;

/// Adds the fields of a sample to an object.
class Fields {
 public:
  Fields(const Entry& entry, boost::json::object& out) : entry_(entry), out_(out) {}

  void operator()(const fabric::Request& request) const {
    out_["attempt"] = request.attempt;
    put_instance("assigned", request.assigned);
    put_text(request.text);
    out_["state"] = request.state;
    put_time(out_, "deadline", request.deadline);
    put_time(out_, "seen", request.seen);
    put_time(out_, "dispatched", request.dispatched);
    out_["replayed"] = request.replayed;
  }
  void operator()(const fabric::Reply& reply) const {
    out_["attempt"] = reply.attempt;
    put_instance("instance", reply.instance);
    out_["reply"] = name_of(reply.kind);
    out_["code"] = name_of(reply.code);
    put_text(reply.text);
    out_["state"] = reply.state;
    put_time(out_, "received", reply.received);
    put_time(out_, "started", reply.started);
    put_time(out_, "answered", reply.answered);
    out_["replayed"] = reply.replayed;
  }
  void operator()(const recording::Withdrawal&) const {}
  void operator()(const fabric::ChannelStatus& status) const { put_channel(out_, status); }
  void operator()(const recording::InstanceNews& news) const {
    out_["change"] = name_of(news.change);
    put_identity(out_, news.identity);
  }
  void operator()(const fabric::InstanceStatus& status) const {
    put_instance("instance", status.instance);
    put_status(out_, status);
  }
  void operator()(const fabric::Event& event) const {
    out_["event"] = name_of(event.kind);
    out_["attempt"] = event.attempt;
    put_time(out_, "at", event.at);
    put_instance("instance", event.instance);
    put_text(event.text);
    out_["state"] = event.state;
    out_["detail"] = utf8(event.detail);
    out_["replayed"] = event.replayed;
  }
  void operator()(const fabric::Command& command) const {
    out_["command"] = command.id.to_string();
    out_["what"] = name_of(command.kind);
    put_text(command.text);
    out_["state"] = command.state;
    put_instance("instance", command.instance);
    out_["issuer"] = utf8(command.issuer);
  }
  void operator()(const fabric::MachineStatus& status) const { put_machine(out_, status); }
  void operator()(const fabric::DataSample& sample) const { put_data(out_, sample); }
  void operator()(const fabric::ProgramEvent& event) const { put_program(out_, event); }
  void operator()(const recording::NoticeNews& news) const {
    // "kind" is what the entry is; which kind of notice, is its name.
    out_["notice"] = utf8(news.notice.key.kind);
    for (const auto& field : json_of(news.notice)) {
      if (field.key() != "kind") {
        out_[field.key()] = field.value();
      }
    }
    out_["over"] = news.over;
  }
  void operator()(const fabric::Outcome& outcome) const {
    put_instance("responder", outcome.responder);
    out_["command"] = outcome.command.to_string();
    out_["done"] = outcome.done;
    out_["detail"] = utf8(outcome.detail);
  }

 private:
  void put_text(const std::string& text) const {
    if (entry_.withheld) {
      out_["text_size"] = *entry_.withheld;
    } else {
      out_["text"] = text_json(text);
    }
  }
  void put_instance(const char* name, const fabric::InstanceId& id) const {
    if (id != fabric::InstanceId{}) {
      out_[name] = id.to_string();
    }
  }

  const Entry& entry_;
  boost::json::object& out_;
};

}  // namespace

boost::json::object json_of(const Entry& entry) {
  boost::json::object out;
  put_time(out, "time", entry.at);
  out["kind"] = kind_of(entry);
  if (const fabric::ChannelKey* key = channel_of(entry); key != nullptr && !key->machine.empty()) {
    out["machine"] = utf8(key->machine);
    out["channel"] = key->channel;
  }
  if (const fabric::CallId call = call_of(entry); call != fabric::CallId{}) {
    out["call"] = call.to_string();
  }
  if (!entry.uuid.empty()) {
    out["uuid"] = utf8(entry.uuid);
  }
  std::visit(Fields(entry, out), entry.sample);
  return out;
}

}  // namespace millrace::tools::print
