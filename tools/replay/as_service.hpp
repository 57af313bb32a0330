// Answers live calls from a recording: one instance for each recorded service, in the recorded
// channels only.
//
//   AsService service(participant, io.get_executor(), plan, options, listener);    // ready from
//   here on
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/registry/heartbeats.hpp"
#include "tools/replay/matcher.hpp"
#include "tools/replay/scheduler.hpp"

namespace millrace::tools::replay {

// Heartbeats for the instances of a replay, like those of a service: they show gateways that the
// instances run, and which calls they have.
//
//   InstanceHeartbeats heartbeats(participant, executor, [this] { return loads(); });   // runs from here on

/// Lives on the executor, which runs one thing at a time.
class InstanceHeartbeats {
 public:
  /// The current load of each instance.
  using Loads = std::function<std::vector<fabric::InstanceLoad>()>;

  /// Throws std::runtime_error if the fabric cannot be used.
  InstanceHeartbeats(const fabric::dds::Participant& participant,
                     const boost::asio::any_io_executor& executor, Loads loads);

  /// Stops the heartbeats of an instance that has left.
  void forget(const fabric::InstanceId& instance) { heartbeats_.forget(instance); }

 private:
  void heartbeat();

  std::chrono::nanoseconds period_;
  Loads loads_;
  fabric::InstanceId process_ = fabric::InstanceId::random();
  fabric::endpoints::HeartbeatEndpoint end_;
  fabric::registry::Heartbeats heartbeats_{process_};
  boost::asio::steady_timer timer_;
};

/// Called on the executor, one at a time.
class AsServiceListener {
 public:
  virtual ~AsServiceListener() = default;
  /// A call was answered from the recording.
  virtual void on_match(const fabric::Request& request, std::size_t call) = 0;
  /// A call was answered with an error; `reason` names what the recording expects.
  virtual void on_mismatch(const fabric::Request& request, const std::string& reason) = 0;
  /// The operator `issuer` drains an instance.
  virtual void on_drain(const fabric::InstanceIdentity& instance, const std::string& issuer) = 0;
  /// Each recorded call was made and its response delivered; or all instances have left.
  virtual void on_complete() = 0;
};

struct AsServiceOptions {
  /// The live channel of each recorded channel.
  std::map<fabric::ChannelKey, fabric::ChannelKey> channels{};
  /// Responses take the recorded time; with Timing::fast none.
  Pace pace{};
  /// 0 = without end.
  std::size_t rounds = 1;
  /// RESPONSE_STATE for a call that does not match; not 0.
  std::uint32_t error_state = 500;
  std::string name{};
  std::string description{};
  std::string version{};
  std::string host{};
};

class AsService : public fabric::endpoints::ReplyEndpointListener,
                  public fabric::endpoints::InstanceCommandsListener {
 public:
  /// All but `executor` and `options` outlive this object. Throws std::runtime_error if the fabric
  /// cannot be used.
  AsService(fabric::dds::Participant& participant, boost::asio::any_io_executor executor,
            const Plan& plan, AsServiceOptions options, AsServiceListener& listener);

  [[nodiscard]] const Matcher& matcher() const { return matcher_; }
  /// One for each recorded UUID.
  [[nodiscard]] std::vector<fabric::InstanceIdentity> instances() const;

  void on_request(const fabric::Request& request) override;
  void on_withdrawn(const fabric::RequestKey& key) override;
  [[nodiscard]] std::optional<std::uint32_t> running(
      const fabric::InstanceId& instance) const override;
  void on_drain(const fabric::InstanceId& instance, const std::string& issuer) override;
  void on_unreported(const fabric::Command& command, const std::string& reason) override;

 private:
  /// A live call that its gateway has not cancelled.
  struct Pending {
    fabric::Request request{};
    fabric::Time received{};
    std::chrono::steady_clock::time_point since{};
    /// Replies that remain, in their order, each after its time.
    std::vector<std::pair<nanoseconds, fabric::Reply>> script{};
    std::size_t sent = 0;
    std::unique_ptr<boost::asio::steady_timer> timer{};
    /// The final response was sent. A call without a response in the recording never gets one.
    bool answered = false;
  };

  void open(fabric::dds::Participant& participant);
  void begin(const fabric::Request& request, const Matched& matched);
  void refuse(const fabric::Request& request, const Mismatch& mismatch);
  void repeat(const fabric::Request& request);
  void reply_next(const fabric::RequestKey& key);
  void publish(Pending& pending);
  /// What heartbeats report about the instances.
  [[nodiscard]] std::vector<fabric::InstanceLoad> loads() const;
  void find_end();
  /// Ends a draining instance that has no reply left to send.
  void leave_if_done(const fabric::InstanceId& instance);
  [[nodiscard]] nanoseconds delay_of(const TimedAnswer& answer) const;
  [[nodiscard]] fabric::endpoints::ReplyEndpoint* end_of(const fabric::InstanceId& instance);

  boost::asio::any_io_executor executor_;
  const Plan& plan_;
  AsServiceOptions options_;
  AsServiceListener& listener_;
  Matcher matcher_;
  std::map<fabric::RequestKey, Pending> pending_;
  bool complete_ = false;
  boost::asio::steady_timer end_timer_;
  std::map<fabric::InstanceId, std::unique_ptr<fabric::endpoints::ReplyEndpoint>> ends_;
  std::map<fabric::InstanceId, fabric::InstanceStatus> statuses_;
  /// For draining instances: the time from which they leave as soon as they are done.
  std::map<fabric::InstanceId, boost::asio::steady_timer> draining_;
  std::optional<fabric::endpoints::InstanceCommands> commands_;
  std::optional<InstanceHeartbeats> heartbeats_;
};

}  // namespace millrace::tools::replay
