// Events on the fabric, one line each: an instance started or ended, a gateway disappeared, a
// program was aborted, a call was blocked, an operator answered it. Pure.
//   events.add(entry, live);                           // before `live` gets the entry
//   events.list(100)                                   // the newest first
//   for (auto& event : events.take()) …                // those that are new or have changed since
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/observer/entry.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::tools::web::plant {

struct PlantEvent {
  /// Counts up. An event that is sent again with the same number has changed.
  std::uint64_t number = 0;
  fabric::Time at{};
  /// As the page names it: "instance started", "call held", …
  std::string_view kind{};
  /// For a gateway, all of its machines.
  std::vector<std::string> machines{};
  std::uint16_t channel = 0;
  fabric::CallId call{};
  std::string uuid{};
  /// Name of the instance, the gateway or the program.
  std::string name{};
  std::string host{};
  std::uint32_t pid = 0;
  /// Which instance, gateway or program.
  fabric::InstanceId who{};
  /// The instance that ended or fell silent was the last of its service.
  bool last = false;
  std::uint32_t error = 0;
  /// The reason or the person: a text of the fabric.
  fabric::Message text{};
};

class EventBook {
 public:
  static constexpr std::size_t most_events = 500;

  /// Derives events from `entry` and the state in `live` before it.
  void add(const recording::Entry& entry, const fabric::plant::Plant& live);

  /// A user has acknowledged the cause `name`.
  void add_acknowledgement(const std::string& name, const std::string& by, const std::string& note,
                           fabric::Time at);

  /// The newest first, at most `most`.
  [[nodiscard]] boost::json::array list(std::size_t most) const;
  /// New or changed events since the last call of take(), the oldest first.
  boost::json::array take();
  [[nodiscard]] bool has_news() const { return !news_.empty(); }

 private:
  void add(const recording::InstanceNews& news, fabric::Time at, const fabric::plant::Plant& live);
  void add(const fabric::InstanceStatus& status, fabric::Time at, const fabric::plant::Plant& live);
  void add(const fabric::MachineStatus& status, fabric::Time at, const fabric::plant::Plant& live);
  void add(const fabric::ChannelStatus& status, fabric::Time at, const fabric::plant::Plant& live);
  void add(const fabric::Event& event, fabric::Time at, const fabric::plant::Plant& live);
  void add(const fabric::ProgramEvent& event, fabric::Time at, const fabric::plant::Plant& live);
  void add(const recording::AlarmNews& news, fabric::Time at, const fabric::plant::Plant& live);
  template <typename Other>
  void add(const Other& /*no event*/, fabric::Time /*at*/, const fabric::plant::Plant& /*live*/) {}
  /// The last event of this link is that the connection was lost.
  [[nodiscard]] bool was_reported_down(const fabric::MachineStatus& status) const;
  void put(PlantEvent event);
  /// One event for all machines of a gateway.
  void put_gateway(std::string_view kind, const fabric::MachineStatus& of, fabric::Time at);

  /// By time, the oldest in front.
  std::deque<PlantEvent> events_;
  std::set<std::uint64_t> news_;
  std::uint64_t number_ = 0;
};

}  // namespace millrace::tools::web::plant
