// Listeners of both endpoints that record their events.
#pragma once

#include <map>
#include <vector>

#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"

namespace millrace::fabric {

struct RecordingGateway : endpoints::CallEndpointListener {
  void on_instance_ready(const InstanceIdentity& instance) override {
    ready.insert_or_assign(instance.id, instance);
  }
  void on_instance_changed(const InstanceIdentity& instance) override {
    ready.insert_or_assign(instance.id, instance);
  }
  void on_instance_gone(const InstanceId& instance) override {
    ready.erase(instance);
    ++gone;
  }
  void on_reply(const Reply& reply) override { replies.push_back(reply); }
  void on_readers(bool of_channels, bool of_events) override {
    channels_read = of_channels;
    events_read = of_events;
  }
  void on_ignored(const std::string& reason) override { ignored.push_back(reason); }

  std::map<InstanceId, InstanceIdentity> ready;
  int gone = 0;
  bool channels_read = false;
  bool events_read = false;
  std::vector<Reply> replies;
  std::vector<std::string> ignored;
};

struct RecordingInstance : endpoints::ReplyEndpointListener {
  void on_request(const Request& request) override { requests.push_back(request); }
  void on_withdrawn(const RequestKey& key) override {
    withdrawn.push_back(without_requester(key));
    withdrawn_by.push_back(key.requester);
  }
  void on_orphaned(const RequestKey& key) override { orphaned.push_back(without_requester(key)); }
  void on_ignored(const std::string& reason) override { ignored.push_back(reason); }
  /// The key in the view of the requester.
  static RequestKey without_requester(RequestKey key) {
    key.requester = 0;
    return key;
  }

  std::vector<Request> requests;
  std::vector<RequestKey> withdrawn;
  std::vector<std::uint64_t> withdrawn_by;
  std::vector<RequestKey> orphaned;
  std::vector<std::string> ignored;
};

}  // namespace millrace::fabric
