// What gateways publish to each other: the topics of machines and channels, as
// fabric::endpoints::GatewayMonitor receives them. Reliable, transient local, keep last 1, by the
// same rules as in fabric.hpp.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fabric/messages.hpp"
#include "tests/simulation/history/fact.hpp"
#include "tests/simulation/time/process.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct FabricConditions;
/// Numbers of the ends in the fabric; each run of a process has its own.
using EndNumber = std::size_t;

/// fabric::endpoints::GatewayMonitorListener.
class GatewayMonitorListener {
 public:
  virtual ~GatewayMonitorListener() = default;
  virtual void on_machine(const fabric::MachineStatus& status) = 0;
  virtual void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) = 0;
  virtual void on_channel(const fabric::ChannelStatus& status) = 0;
};

class GatewayTopics {
 public:
  GatewayTopics(Agenda& agenda, const FabricConditions& conditions, Random random)
      : agenda_(agenda), conditions_(conditions), random_(random) {}

  void join(EndNumber end, Process& process, GatewayMonitorListener& listener);
  void leave(EndNumber end, bool in_order);
  void frozen(EndNumber end);
  void thawed(EndNumber end, Time after);
  void set_path(EndNumber from, EndNumber to, bool open);
  void open_all_paths();

  void publish(EndNumber end, const fabric::MachineStatus& status);
  void publish(EndNumber end, const fabric::ChannelStatus& status);
  void let_go(EndNumber end, const std::string& machine);
  void let_go(EndNumber end, const Key& key);
  /// From now on this end receives channels too: their present state and each change.
  void subscribe_channels(EndNumber end);

  /// Whether all that `from` has published has arrived at `to`, and nothing blocks the next sample.
  [[nodiscard]] bool hears(EndNumber to, EndNumber from) const;

 private:
  template <typename Value>
  struct Sample {
    std::uint64_t number = 0;
    /// None: disposed.
    std::optional<Value> value;
  };
  struct End {
    Process* process = nullptr;
    std::uint64_t life = 0;
    GatewayMonitorListener* listener = nullptr;
    bool there = true;
    bool awake = true;
    bool watches_channels = false;
    // The number of its last sample.
    std::uint64_t last = 0;
    std::map<std::string, Sample<fabric::MachineStatus>> machines;
    std::map<Key, Sample<fabric::ChannelStatus>> channels;
    // Samples that have arrived and are not taken yet; no value: the gateway is gone.
    std::map<std::pair<std::string, EndNumber>, std::optional<fabric::MachineStatus>> machines_in;
    std::map<Key, fabric::ChannelStatus> channels_in;
    /// The gateway of each end from which it has received a state, by machine.
    std::map<std::pair<std::string, EndNumber>, fabric::InstanceId> known;
    bool due = false;
  };
  /// From one gateway to another.
  struct Way {
    EndNumber from = 0;
    EndNumber to = 0;
    bool path = true;
    bool passes = false;
    bool found = false;
    std::uint64_t epoch = 0;
    std::uint64_t machines = 0;
    std::uint64_t channels = 0;
    bool due = false;
  };
  using WayPointer = std::shared_ptr<Way>;

  void refresh(const WayPointer& way);
  void find(const WayPointer& way);
  void lose(const WayPointer& way);
  void send(EndNumber from);
  void send(const WayPointer& way);
  void arrive(const WayPointer& way);
  void wake(EndNumber end);
  void take(End& end);
  void after(const Way& way, Time delay, std::function<void()> act);
  [[nodiscard]] Time delay();

  Agenda& agenda_;
  const FabricConditions& conditions_;
  Random random_;
  std::map<EndNumber, End> ends_;
  std::vector<WayPointer> ways_;
};

}  // namespace millrace::tests::simulation
