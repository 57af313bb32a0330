// The request writers, one for each instance: opened when its process has proved that it may
// answer, so that announcements alone cost no writer; closed when it is gone and no request is
// pending.
//
//   RequestWriters writers(participant, executor, weak_from_this(), matches);
//   writers.open({uuid, instance});
//   writers.publish(request);
//   writers.on_vanished(instance);
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/listeners.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/turn.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/topics.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

class RequestWriters {
 public:
  /// `owner` sees the owner of this gone; `matches` hears whose readers are matched, and outlives
  /// this.
  RequestWriters(const dds::Participant& participant, boost::asio::any_io_executor executor,
                 std::weak_ptr<void> owner, dds::MatchQueue& matches);
  ~RequestWriters() { flush(); }
  RequestWriters(const RequestWriters&) = delete;
  RequestWriters& operator=(const RequestWriters&) = delete;

  /// Replaces the writer of another UUID with this instance id. Throws std::runtime_error with
  /// Cyclone's reason.
  void open(const wire::RequestPartition& of);
  /// No process is the instance any more.
  void on_vanished(const InstanceId& instance);

  /// See CallEndpoint.
  tl::expected<void, std::string> publish(const Request& request);
  void withdraw(const RequestKey& key);
  /// Sends what waits for the end of the turn.
  void flush();

 private:
  /// Of one instance.
  struct RequestWriter {
    RequestWriter(const dds::Participant& participant, const wire::RequestPartition& of,
                  const wire::EndpointOptions& options)
        : uuid(of.uuid),
          writer(participant,
                 wire::request_partition(participant.options().fabric, of.uuid, of.instance),
                 options) {}

    std::string uuid;
    wire::Writer<Request> writer;
    /// Requests that were written and not withdrawn.
    std::unordered_set<RequestKey, RequestKeyHash> pending;
    bool vanished = false;
    /// It waits for the end of the turn.
    bool unsent = false;
  };
  using Writers = std::map<InstanceId, RequestWriter>;

  void wrote(RequestWriter& target);
  void await_round();
  void close_if_done(Writers::iterator target);

  const dds::Participant& participant_;
  boost::asio::any_io_executor executor_;
  std::weak_ptr<void> owner_;
  dds::MatchQueue& matches_;
  Writers writers_;
  Turn turn_;
  /// Those whose requests wait for the end of the turn.
  std::vector<RequestWriter*> unsent_;
};

}  // namespace millrace::fabric::endpoints
