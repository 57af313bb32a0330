// Listens to the fabric: events of calls and states of channels, as they come.
//
//   Recorder recorder(join, {.without_text = {"560aacbf-…"}}, [&](Row row) { writer.record(row);
//   });
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "fabric/dds/participant.hpp"
#include "services/archiver/row.hpp"

namespace millrace::services::archiver {

struct RecorderOptions {
  bool events = true;
  bool channels = true;
  /// Canonical UUIDs of calls whose texts are not to be kept.
  std::set<std::string> without_text{};
};

/// Drains its readers on a thread of its own, so that no writer on the fabric waits for it.
class Recorder {
 public:
  /// `sink` is called on that thread. Throws std::runtime_error if the fabric cannot be joined.
  Recorder(const fabric::dds::ParticipantOptions& join, RecorderOptions options,
           std::function<void(Row)> sink);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::services::archiver
