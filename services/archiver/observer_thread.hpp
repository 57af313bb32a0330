// Makes rows of what an observer of the fabric sees, as it arrives: events of calls, states of
// channels, values of machines and events of NC programs.
//
//   ObserverThread observer(join, {.without_text = {"560aacbf-…"}},
//                           [&](Row row) { writer.record(std::move(row)); });
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "fabric/dds/participant.hpp"
#include "services/archiver/row.hpp"

namespace millrace::services::archiver {

struct Observed {
  bool events = true;
  bool channels = true;
  /// Values of machines.
  bool data = true;
  bool programs = true;
  /// Canonical UUIDs of calls whose texts are not stored.
  std::set<std::string> without_text{};
};

/// Observes on its own thread, so that no writer on the fabric waits for the archive.
class ObserverThread {
 public:
  /// `sink` is called on that thread. Throws std::runtime_error if joining the fabric fails.
  ObserverThread(const fabric::dds::ParticipantOptions& join, Observed wanted,
                 std::function<void(Row)> sink);
  ~ObserverThread();
  ObserverThread(const ObserverThread&) = delete;
  ObserverThread& operator=(const ObserverThread&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::archiver
