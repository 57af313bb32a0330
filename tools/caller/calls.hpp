// The calls of a tool that acts as a gateway: dispatches each to one instance as a gateway does,
// and ends it with its reply. Pure: events and times in, actions out.
//
//   Calls calls(slot.before_first());
//   calls.on_instance_ready(identity);
//   const auto id = calls.add({.key = {"call.7f3a", 1}, .uuid = "…", .text = "3"}, now);
//   for (const Action& action : calls.take_actions()) …        → Notice, Publish
//   calls.on_reply(reply, now);                                → Notice, Ended
//   calls.on_time(now);                                        → Withdraw
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/request_key.hpp"
#include "gateway/channel/answered_requests.hpp"
#include "gateway/dispatch/dispatcher.hpp"
#include "gateway/moment.hpp"
#include "tools/caller/order.hpp"

namespace millrace::tools::caller {

using gateway::Moment;
using gateway::SteadyTime;

/// Publish the call; answered by on_unpublished if that fails.
struct Publish {
  fabric::Request request;
};
/// Take it back.
struct Withdraw {
  fabric::RequestKey key;
};
/// For observers.
struct Notice {
  fabric::Event event;
};
/// An interim reply.
struct Interim {
  fabric::Reply reply;
};

using Action = std::variant<Publish, Withdraw, Notice, Interim, Ended>;
using Actions = std::vector<Action>;

class Calls {
 public:
  /// The ids of the calls continue after `last`; no other caller may use them (see Slot).
  explicit Calls(fabric::CallId last, gateway::dispatch::DispatcherOptions options = {})
      : last_(last), dispatcher_(options) {}

  /// A new call; it waits while no instance is free for it. Fails for state 0, for a text that is
  /// too long, and while its channel has another pending call.
  tl::expected<fabric::CallId, std::string> add(const Order& order, Moment now);
  /// Withdraws a call and ends it; without effect if it has ended.
  void give_up(const fabric::CallId& call, const fabric::Message& reason, Moment now);

  void on_instance_ready(const fabric::InstanceIdentity& identity, Moment now);
  void on_instance_gone(const fabric::InstanceId& instance, Moment now);
  void on_load(const fabric::InstanceLoad& load, Moment now);
  void on_reply(const fabric::Reply& reply, Moment now);
  void on_unpublished(const fabric::CallId& call, const fabric::Message& reason, Moment now);
  /// Ends calls that have waited too long, and moves calls from instances that stay away.
  void on_time(Moment now);
  /// When on_time has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

  /// Why no instance serves this UUID for this channel; nullopt if one does.
  [[nodiscard]] std::optional<fabric::Message> why_unserved(const std::string& uuid,
                                                            const fabric::ChannelKey& key) const {
    return dispatcher_.why_unserved(uuid, key);
  }
  /// Whether an instance has the call now.
  [[nodiscard]] bool is_given_out(const fabric::CallId& call) const;
  /// Calls that have not ended.
  [[nodiscard]] std::size_t pending() const { return open_.size(); }
  /// Ends all calls, and withdraws what stands.
  void leave(const fabric::Message& reason, Moment now);

  /// The actions since the last call of this function, in order.
  Actions take_actions();

 private:
  struct Open {
    Order order;
    fabric::Time seen{};
    std::optional<SteadyTime> until{};
    /// The newest attempt, and the instances of all.
    std::uint32_t attempt = 0;
    std::vector<fabric::InstanceId> asked{};
    /// The instances in whose partitions the request is pending.
    std::vector<fabric::InstanceId> standing{};
    bool published = false;
    /// When it was first dispatched.
    std::optional<SteadyTime> given{};
    /// Why it waits.
    fabric::Message reason{};
  };

  void carry_out(const gateway::dispatch::Decisions& decisions, Moment now);
  void give(const gateway::dispatch::Assign& give, Moment now);
  void take_back(const gateway::dispatch::Unassign& back, Moment now);
  void withdraw(Open& open, const fabric::InstanceId& instance);
  void decline(const fabric::Reply& reply, Moment now);
  /// By value: the id of a caller may be the one in open_.
  void end(fabric::CallId call, std::optional<fabric::Reply> reply, const fabric::Message& reason,
           Moment now);
  void tell(const fabric::CallId& call, const Open& open, fabric::EventKind kind, Moment now,
            const fabric::Reply* reply = nullptr, const fabric::Message& detail = {});

  fabric::CallId last_;
  gateway::dispatch::Dispatcher dispatcher_;
  std::map<fabric::CallId, Open> open_;
  std::map<fabric::ChannelKey, fabric::CallId> by_channel_;
  gateway::channel::AnsweredRequests answered_;
  Actions out_;
};

}  // namespace millrace::tools::caller
