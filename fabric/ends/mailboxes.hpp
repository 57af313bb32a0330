// Where instances get their requests: a writer for each, opened when it is seen, closed when it is
// gone and nothing stands in it.
//
//   Mailboxes mailboxes(participant, executor, weak_from_this(), matches);
//   mailboxes.open({uuid, instance});
//   mailboxes.publish(request);
//   mailboxes.on_vanished(instance);
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/match_queue.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/topics.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

class Mailboxes {
 public:
  /// `owner` sees the owner of this gone; `matches` hears whose readers are matched, and outlives
  /// this.
  Mailboxes(const dds::Participant& participant, boost::asio::any_io_executor executor,
            std::weak_ptr<void> owner, dds::MatchQueue& matches);
  ~Mailboxes() { flush(); }
  Mailboxes(const Mailboxes&) = delete;
  Mailboxes& operator=(const Mailboxes&) = delete;

  /// Throws std::runtime_error with Cyclone's reason.
  void open(const wire::Mailbox& of);
  /// Nobody reads it any more.
  void on_vanished(const InstanceId& instance);

  /// See CallEnd.
  tl::expected<void, std::string> publish(const Request& request);
  void withdraw(const RequestKey& key);
  /// Sends what waits for the end of the turn.
  void flush();

 private:
  /// Of one instance.
  struct Mailbox {
    Mailbox(const dds::Participant& participant, const std::string& partition,
            const wire::EndpointOptions& options)
        : writer(participant, partition, options) {}

    wire::Writer<Request> writer;
    /// What was written and not taken back.
    std::unordered_set<RequestKey, RequestKeyHash> standing;
    bool vanished = false;
    /// It waits for the end of the turn.
    bool unsent = false;
  };
  using Boxes = std::map<InstanceId, Mailbox>;

  void wrote(Mailbox& mailbox);
  void close_if_done(Boxes::iterator mailbox);

  const dds::Participant& participant_;
  boost::asio::any_io_executor executor_;
  std::weak_ptr<void> owner_;
  dds::MatchQueue& matches_;
  Boxes boxes_;
  /// Until the end of this turn of the executor: what was sent at once, and what waits.
  bool in_turn_ = false;
  std::vector<Mailbox*> unsent_;
};

}  // namespace millrace::fabric::ends
