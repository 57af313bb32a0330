// The link from a gateway to a controller, which behaves like gateway/machine_link and cnc/ads: one
// connection, which is restored automatically; requests keep their order; at its end everything
// pending fails.
//
// A controller executes what it has received on a connection that is gone before it answers on a
// new one of the same host, or never; the behaviour of real controllers is not documented.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/machines/controller.hpp"
#include "gateway/shell/back_off.hpp"
#include "tests/simulation/machine/controller.hpp"
#include "tests/simulation/time/process.hpp"

namespace millrace::tests::simulation {

/// How reliable a controller's notifications are. Numbers are percentages.
struct NotificationBehaviour {
  bool refuses = false;
  /// Grants the subscription and notifies nothing, or only the first values.
  bool silent = false;
  bool first_only = false;
  unsigned lost = 0;
  /// Reports that the handle is not valid any more.
  unsigned dropped = 0;
  /// Delay after the sample.
  Time late{};
  /// Cycle of its task: a change that is undone within a cycle is not notified.
  Time cycle = 1ms;
};

/// How long after its acknowledgement a controller applies a write. The delay of each variable is
/// constant: writes of one variable keep their order, writes of two may not.
struct WriteBehaviour {
  Time response{};
  Time request_state{};
  Time response_state{};
  /// Percentage that is acknowledged and never applied.
  unsigned lost = 0;
  [[nodiscard]] Time delay_of(gateway::Variable variable) const {
    switch (variable) {
      case gateway::Variable::response:
        return response;
      case gateway::Variable::request_state:
        return request_state;
      case gateway::Variable::response_state:
        return response_state;
      default:
        return {};
    }
  }
};

/// The network between gateway and controller; outlives both.
struct LinkConditions {
  NotificationBehaviour notifications{};
  WriteBehaviour writes{};
  bool plugged = true;
  /// It carries nothing, and neither side notices.
  bool silent = false;
  /// While it is silent, a router in front of the controller answers each request with an error.
  bool router_refuses = false;
  /// In one direction.
  Time delay_least = 100us;
  Time delay_most = 2ms;
  /// Until then, requests from the time when the link was slow may still be under way; later
  /// requests wait for them.
  Time late_until{};
  /// Percentages of requests that the controller refuses or loses.
  unsigned refused = 0;
  unsigned lost = 0;
};

/// A write and its context.
struct AdsWrite {
  gateway::Variable variable{};
  gateway::Value value;
  fabric::CallId call;
  gateway::PendingRequest request;
  std::optional<gateway::Answer> answer;
  /// The beginning of the read that the gateway's decision is based on.
  Time read{};
};

/// Sees more of what a gateway does than its controller.
class LinkObserver {
 public:
  virtual ~LinkObserver() = default;
  /// The next on_read() has what was read from `first` until now.
  virtual void on_looked(Time first) = 0;
  virtual AdsWrite describe(const Key& key, gateway::Variable variable,
                            const gateway::Value& value) = 0;
};

class AdsLink : public std::enable_shared_from_this<AdsLink> {
 public:
  /// Without `channels`, all channels of the controller.
  AdsLink(Process& process, GatewayNumber gateway, Controller& controller,
          LinkConditions& conditions, std::vector<std::uint16_t> channels,
          gateway::machines::ControllerEvents& events, LinkObserver& observer, History& history,
          Random random);

  void start();
  /// The gateway is gone: it gets no further events.
  void abandon();
  [[nodiscard]] bool abandoned() const { return abandoned_; }
  void read(std::uint16_t channel, gateway::ReadSet set);
  void write(std::uint16_t channel, gateway::Variable variable, const gateway::Value& value);
  /// A request to the controller that is not about Service Interfaces.
  struct Work {
    /// Runs at the controller, as a whole.
    std::function<void()> carry_out;
    /// Runs at the gateway, never from within ask(), and never if the link is destroyed before.
    /// `failure` is empty if the request was carried out.
    std::function<void(const std::string& failure)> on_answer;
  };
  void ask(Work work);
  void subscribe(const std::vector<std::uint16_t>& channels);
  void unsubscribe(const std::vector<std::uint16_t>& channels);
  /// The conditions or the controller ends the connection.
  void cut(const std::string& reason);

 private:
  struct Request;
  using RequestPointer = std::shared_ptr<Request>;

  void connect();
  void wait_and_connect();
  void leave_to_controller();
  void came_up();
  void send(const RequestPointer& request);
  void refuse_unsent(std::uint16_t channel, bool is_write);
  void execute(const RequestPointer& request);
  void apply(const RequestPointer& request);
  void sample(const RequestPointer& request, std::size_t next);
  void answer(const RequestPointer& request, Time delay);
  void answered(const RequestPointer& request);
  void refused_by_router(const RequestPointer& request);
  void timed_out(const RequestPointer& request);
  void fail(const Request& request, bool timeout);
  void begin_notifying(std::uint16_t channel);
  void sample_later(std::uint16_t channel);
  void take_sample(std::uint16_t channel);
  void tell(std::uint16_t channel, gateway::Variable variable, std::optional<std::uint32_t> value);
  void stop_notifying(std::uint16_t channel);
  void stop_notifying();
  [[nodiscard]] bool still(std::uint64_t connection) const;
  [[nodiscard]] Time delay();
  /// All consequences of a request at the controller, and its response at the gateway.
  [[nodiscard]] std::optional<Meaning> meaning(const Request& request, const char* step) const;
  /// `act` runs in the gateway only if this link still exists.
  void later(Time delay, void (AdsLink::*act)(const RequestPointer&),
             const RequestPointer& request);

  Process& process_;
  GatewayNumber gateway_;
  Controller& controller_;
  LinkConditions& conditions_;
  std::vector<std::uint16_t> channels_;
  gateway::machines::ControllerEvents& events_;
  LinkObserver& observer_;
  History& history_;
  Random random_;
  gateway::shell::BackOff back_off_;
  bool up_ = false;
  std::optional<Time> up_since_;
  bool abandoned_ = false;
  std::uint64_t connection_ = 0;
  std::uint64_t controller_life_ = 0;
  Time last_execution_{};
  /// Responses of the controller, also after their timeout.
  std::uint64_t answers_ = 0;
  Time answered_in_time_{};
  /// Since then, the router has answered instead of the controller.
  std::optional<Time> router_refuses_since_;
  /// Requests that the gateway waits for, and those that the controller has not executed.
  std::vector<RequestPointer> pending_;
  std::vector<RequestPointer> queued_;
  /// What the controller has notified of the channels that it was asked to watch.
  struct Subscription {
    std::map<gateway::Variable, std::uint32_t> last;
    bool sampling = false;
  };
  std::map<std::uint16_t, Subscription> subscriptions_;
  /// Counts the requests about each channel, to match responses with them.
  std::map<std::uint16_t, std::uint64_t> questions_;
  Time last_notification_{};
  /// When the last answered read of each channel began.
  std::map<std::uint16_t, Time> reads_;
};

}  // namespace millrace::tests::simulation
