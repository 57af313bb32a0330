// The DDS side between gateways and instances, with only the guarantees of reliable, transient
// local, keep last 1:
//
// - A writer keeps the newest sample of each key, also for a reader that is matched late. A sample
//   that is overwritten before it is sent is never seen. Samples of one writer keep their order.
// - The disposal of a sample is seen by matched readers that had it, not by later ones. It may
//   overtake the sample itself; so may the loss of its writers.
// - Each side finds and loses the other separately (discovery, lease). A reader that loses a writer
//   and finds it again gets its samples once more.
// - A killed process leaves nothing; a frozen one is lost by its lease and loses others.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fabric/registry/instance_registry.hpp"
#include "fabric/request_key.hpp"
#include "tests/simulation/fabric/gateway_topics.hpp"
#include "tests/simulation/history/history.hpp"
#include "tests/simulation/time/process.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

/// fabric::endpoints::CallEndpointListener, as the gateway hears it.
class GatewayListener {
 public:
  virtual ~GatewayListener() = default;
  virtual void on_instance_ready(const fabric::InstanceIdentity& instance) = 0;
  virtual void on_instance_changed(const fabric::InstanceIdentity& instance) = 0;
  virtual void on_instance_gone(const fabric::InstanceId& instance) = 0;
  virtual void on_load(const fabric::InstanceLoad& load) = 0;
  virtual void on_reply(const fabric::Reply& reply) = 0;
  /// A reply in the name of an instance, from a writer that is not the instance's.
  virtual void on_stranger(const fabric::Reply& reply) = 0;
};

/// fabric::endpoints::ReplyEndpointListener.
class InstanceListener {
 public:
  virtual ~InstanceListener() = default;
  virtual void on_request(const fabric::Request& request) = 0;
  virtual void on_withdrawn(const fabric::RequestKey& key) = 0;
  virtual void on_orphaned(const fabric::RequestKey& key) = 0;
};

struct FabricConditions {
  /// The delay of a sample.
  Time delay_least = 50us;
  Time delay_most = 2ms;
  /// This percentage is lost and sent again after a heartbeat.
  unsigned lost = 0;
  Time lease = 500ms;
  Time discovery_least = 1ms;
  Time discovery_most = 30ms;
};

class Fabric {
 public:
  Fabric(Agenda& agenda, Random random)
      : agenda_(agenda), random_(random), gateway_topics_(agenda, conditions, random_.fork()) {}

  FabricConditions conditions;

  EndNumber join(Process& process, GatewayListener& listener, GatewayMonitorListener& watch);
  EndNumber join(Process& process, InstanceListener& listener,
                 const fabric::InstanceIdentity& identity);
  /// `in_order`: it sends a farewell; otherwise the others lose it by its lease.
  void leave(EndNumber end, bool in_order);
  /// Its process was frozen, or continues after this time.
  void frozen(EndNumber end);
  void thawed(EndNumber end, Time after);

  /// False if the partition of the instance is not open yet.
  bool publish(EndNumber gateway, const fabric::Request& request);
  void withdraw(EndNumber gateway, const fabric::RequestKey& key);
  /// Publishes the instance's load to the ends that hear it now; a lost heartbeat is not repeated.
  void heartbeat(EndNumber instance, const fabric::InstanceLoad& load);
  void publish(EndNumber instance, const fabric::Reply& reply);
  void change_identity(EndNumber instance, const fabric::InstanceIdentity& identity);

  /// Opens or closes the path from one end to the other.
  void set_path(EndNumber from, EndNumber to, bool open);
  void open_all_paths();
  /// The topics between gateways.
  [[nodiscard]] GatewayTopics& gateway_topics() { return gateway_topics_; }
  [[nodiscard]] const GatewayTopics& gateway_topics() const { return gateway_topics_; }
  /// The ends that exist.
  [[nodiscard]] std::vector<EndNumber> ends() const;
  /// What has arrived at this end and what it knows of the others; for a walk through all orders.
  [[nodiscard]] std::string place_of(EndNumber end) const;

 private:
  template <typename Value>
  struct Sample {
    std::uint64_t number = 0;
    /// None: disposed.
    std::optional<Value> value;
  };
  template <typename SampleKey, typename Value>
  struct Writer {
    std::uint64_t last = 0;
    std::map<SampleKey, Sample<Value>> samples;
  };
  /// The request that is answered, and the instance in whose name.
  using ReplyKey = std::pair<fabric::RequestKey, fabric::InstanceId>;
  /// As fabric::wire::InstanceState.
  enum class InstanceState : std::uint8_t { alive, disposed, no_writers };
  /// A sample in a reader that its process has not taken yet.
  struct Cached {
    fabric::Request value;
    InstanceState instance_state = InstanceState::alive;
  };
  struct End {
    Process* process = nullptr;
    std::uint64_t life = 0;
    bool there = true;
    bool awake = true;
    GatewayListener* gateway = nullptr;
    InstanceListener* instance = nullptr;
    // Of a gateway.
    fabric::registry::InstanceRegistry registry;
    /// Everything that went into the registry and came out of it.
    Meaning registry_knows = 0;
    /// Requests, by the partition of the instance.
    std::map<fabric::InstanceId, Writer<fabric::RequestKey, fabric::Request>> requests;
    /// Replies, by the end that has written them.
    std::map<std::pair<ReplyKey, EndNumber>, fabric::Reply> replies_in;
    bool discovery_due = false;
    // Of an instance.
    fabric::InstanceIdentity identity;
    Writer<ReplyKey, fabric::Reply> replies;
    std::map<fabric::RequestKey, Cached> requests_in;
    /// The gateways that have written a request here.
    std::map<fabric::RequestKey, std::set<EndNumber>> requested_by;
    bool drain_due = false;
  };
  /// One end as the other knows it.
  struct Side {
    bool path = true;
    /// What this end sends reaches the other one.
    bool passes = false;
    /// Whether the gateway has found the request reader and the reply writer of the instance; the
    /// instance finds both of a gateway or neither.
    bool reader = false;
    bool writer = false;
    std::uint64_t epoch = 0;
  };
  struct Pair {
    EndNumber gateway = 0;
    EndNumber instance = 0;
    /// What the gateway knows of the instance, and the instance of the gateway.
    Side of_instance;
    Side of_gateway;
    /// Numbers of the newest samples that arrived.
    std::uint64_t requests = 0;
    std::uint64_t replies = 0;
    bool requests_due = false;
    bool replies_due = false;
  };

  using PairPointer = std::shared_ptr<Pair>;

  EndNumber add(Process& process);
  /// Endpoints of an instance.
  static fabric::registry::EndpointHandle reader_of(EndNumber end) { return 2 * end + 1; }
  static fabric::registry::EndpointHandle writer_of(EndNumber end) { return 2 * end + 2; }
  void pair_up(EndNumber gateway, EndNumber instance);
  void refresh(const PairPointer& pair);
  void refresh(const PairPointer& pair, Side& side, const End& other, bool of_instance);
  void find(const PairPointer& pair, bool of_instance);
  /// An instance that is not heard has got a request, after which a heartbeat should come soon.
  void lose_after_request(const PairPointer& pair);
  void lose_known(const PairPointer& pair, bool of_instance);
  void discover(const PairPointer& pair, bool reader);
  void look_around(EndNumber gateway);
  void take_changes(EndNumber gateway);
  void send_requests(const PairPointer& pair, bool again = false);
  void send_replies(const PairPointer& pair, bool again = false);
  void arrive_requests(const PairPointer& pair);
  void arrive_replies(const PairPointer& pair);
  void orphan(EndNumber instance, EndNumber gateway);
  void wake_to_take_requests(EndNumber instance);
  void take_requests(EndNumber instance);
  void take_replies(EndNumber gateway);
  [[nodiscard]] std::string place_of_gateway(const End& end, EndNumber number) const;
  [[nodiscard]] std::string place_of_instance(const End& end, EndNumber number) const;
  [[nodiscard]] Time delay(bool again);
  /// The parties that change when something arrives at this end.
  [[nodiscard]] static std::uint64_t hearing(const End& end) {
    return end.gateway != nullptr ? end.process->inbox() : end.process->parties();
  }
  [[nodiscard]] std::uint64_t parties(const Pair& pair) const;
  void within(const PairPointer& pair, Time delay, std::function<void()> act);
  /// For a walk through all orders: the newest sample of an end. It then has one channel, and the
  /// text follows from the call.
  void lay_out(const End& end, const fabric::CallId& call, std::uint32_t what,
               const fabric::InstanceId& instance, std::uint64_t number);
  /// The published samples of one end arrive at the other.
  void fetch(EndNumber reader, EndNumber writer, Time delay, std::function<void()> act);
  [[nodiscard]] std::vector<PairPointer> pairs_of(EndNumber end) const;

  Agenda& agenda_;
  Random random_;
  std::vector<std::unique_ptr<End>> ends_;
  std::vector<PairPointer> pairs_;
  GatewayTopics gateway_topics_;
};

}  // namespace millrace::tests::simulation
