// The DDS side between gateways and instances, with what reliable, transient local, keep last 1
// promises and nothing more:
//
// - a writer keeps the newest sample of each key; a reader that is matched gets it, also late; what
//   is overwritten before it is sent is never seen; the samples of one writer come in their order;
// - a sample taken back is seen as such by who is matched and had it, not by who comes later; it
//   may overtake the sample itself; so may the news that its writers are gone;
// - each side finds and loses the other on its own, by hearing from it (discovery, lease); who
//   loses a writer and finds it again gets its samples once more;
// - a process that is killed leaves nothing; one that is frozen is lost by lease and loses others.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fabric/registry/instance_registry.hpp"
#include "fabric/request_key.hpp"
#include "tests/simulation/fabric/gateway_talk.hpp"
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
  /// A reply in the name of an instance that has not written it.
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

struct FabricWeather {
  /// A sample's way.
  Time delay_least = 50us;
  Time delay_most = 2ms;
  /// So many in a hundred are lost and sent again after a heartbeat.
  unsigned lost = 0;
  Time lease = 500ms;
  Time discovery_least = 1ms;
  Time discovery_most = 30ms;
};

class Fabric {
 public:
  Fabric(Agenda& agenda, Random random)
      : agenda_(agenda), random_(random), talk_(agenda, weather, random_.fork()) {}

  FabricWeather weather;

  EndNumber join(Process& process, GatewayListener& listener, GatewayMonitorListener& watch);
  EndNumber join(Process& process, InstanceListener& listener,
                 const fabric::InstanceIdentity& identity);
  /// `told`: it says good-bye; otherwise the others find out by its lease.
  void leave(EndNumber end, bool told);
  /// Its process was frozen, or goes on after so long.
  void frozen(EndNumber end);
  void thawed(EndNumber end, Time after);

  /// False if the partition of its instance is not open yet.
  bool publish(EndNumber gateway, const fabric::Request& request);
  void withdraw(EndNumber gateway, const fabric::RequestKey& key);
  /// What an instance does, for whoever hears it now; a heartbeat that is lost is lost.
  void heartbeat(EndNumber instance, const fabric::InstanceLoad& load);
  void publish(EndNumber instance, const fabric::Reply& reply);
  void change_identity(EndNumber instance, const fabric::InstanceIdentity& identity);

  /// Whether anything comes through from one end to the other.
  void set_path(EndNumber from, EndNumber to, bool open);
  void open_all_paths();
  /// Between gateways.
  [[nodiscard]] GatewayTalk& talk() { return talk_; }
  [[nodiscard]] const GatewayTalk& talk() const { return talk_; }
  /// The ends that are there.
  [[nodiscard]] std::vector<EndNumber> ends() const;
  /// What has come to this end and what it knows of the others. For who tries all orders.
  [[nodiscard]] std::string place_of(EndNumber end) const;

 private:
  template <typename Value>
  struct Sample {
    std::uint64_t number = 0;
    /// None: taken back.
    std::optional<Value> value;
  };
  template <typename SampleKey, typename Value>
  struct Writer {
    std::uint64_t last = 0;
    std::map<SampleKey, Sample<Value>> samples;
  };
  /// Which request, and in whose name it is answered.
  using ReplyKey = std::pair<fabric::RequestKey, fabric::InstanceId>;
  /// As fabric::wire::InstanceState.
  enum class InstanceState : std::uint8_t { alive, disposed, no_writers };
  /// What a reader has and its process has not taken.
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
    // A gateway's.
    fabric::registry::InstanceRegistry registry;
    /// All that the registry was told and has told.
    Meaning registry_knows = 0;
    /// The partitions of instances.
    std::map<fabric::InstanceId, Writer<fabric::RequestKey, fabric::Request>> requests;
    /// With the end that has written it.
    std::map<std::pair<ReplyKey, EndNumber>, fabric::Reply> replies_in;
    bool discovery_due = false;
    // An instance's.
    fabric::InstanceIdentity identity;
    Writer<ReplyKey, fabric::Reply> replies;
    std::map<fabric::RequestKey, Cached> requests_in;
    /// Gateways that have a request here.
    std::map<fabric::RequestKey, std::set<EndNumber>> requested_by;
    bool drain_due = false;
  };
  /// One end as the other knows it.
  struct Side {
    bool path = true;
    /// The other hears this one.
    bool heard = false;
    /// What the gateway knows of the instance: its request reader, its reply writer; the instance
    /// knows both or none.
    bool reader = false;
    bool writer = false;
    std::uint64_t epoch = 0;
  };
  struct Pair {
    EndNumber gateway = 0;
    EndNumber instance = 0;
    /// What the gateway has of the instance, and the instance of the gateway.
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
  /// Of an instance's end.
  static fabric::registry::EndpointHandle reader_of(EndNumber end) { return 2 * end + 1; }
  static fabric::registry::EndpointHandle writer_of(EndNumber end) { return 2 * end + 2; }
  void pair_up(EndNumber gateway, EndNumber instance);
  void refresh(const PairPointer& pair);
  void refresh(const PairPointer& pair, Side& side, const End& other, bool of_instance);
  void find(const PairPointer& pair, bool of_instance);
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
  /// What changes when something comes to this end.
  [[nodiscard]] static std::uint64_t hearing(const End& end) {
    return end.gateway != nullptr ? end.process->inbox() : end.process->parties();
  }
  [[nodiscard]] std::uint64_t parties(const Pair& pair) const;
  void within(const PairPointer& pair, Time delay, std::function<void()> act);
  /// For who tries all orders: the newest sample of an end. It has one channel then, and the text
  /// follows from the call.
  void lay_out(const End& end, const fabric::CallId& call, std::uint32_t what,
               const fabric::InstanceId& instance, std::uint64_t number);
  /// What one end has laid out arrives at the other.
  void fetch(EndNumber reader, EndNumber writer, Time delay, std::function<void()> act);
  [[nodiscard]] std::vector<PairPointer> pairs_of(EndNumber end) const;

  Agenda& agenda_;
  Random random_;
  std::vector<std::unique_ptr<End>> ends_;
  std::vector<PairPointer> pairs_;
  GatewayTalk talk_;
};

}  // namespace millrace::tests::simulation
