// The events of a plant, as the page lists them: the newest first, one for all machines of a
// gateway, one for what two gateways report. Pure.
//   if (const auto event = fabric::plant::event_of(entry, plant)) events.add(*event);
//   events.list(100)
//   for (auto& event : events.take()) …                // those that are new or have changed since
#pragma once

#include <cstdint>
#include <deque>
#include <set>

#include <boost/json/array.hpp>

#include "fabric/plant/event.hpp"

namespace millrace::tools::web::plant {

class EventBook {
 public:
  static constexpr std::size_t most_events = 500;

  void add(fabric::plant::PlantEvent event);

  /// The newest first, at most `most`.
  [[nodiscard]] boost::json::array list(std::size_t most) const;
  /// New or changed events since the last call of take(), the oldest first.
  boost::json::array take();
  [[nodiscard]] bool has_news() const { return !news_.empty(); }

 private:
  struct NumberedEvent {
    /// Counts up. An event that is sent again with the same number has changed.
    std::uint64_t number = 0;
    fabric::plant::PlantEvent event{};
  };
  static boost::json::object json_of(const NumberedEvent& numbered);
  /// True if a known event says the same, maybe of another machine.
  bool joins_known(const fabric::plant::PlantEvent& event);

  /// By time, the oldest in front.
  std::deque<NumberedEvent> events_;
  std::set<std::uint64_t> news_;
  std::uint64_t number_ = 0;
};

}  // namespace millrace::tools::web::plant
