// The end of a process that has instances: says that it is there, and what they do.
//
//   BeatEnd end(participant);
//   end.publish({.member = process, .at = now, .loads = …});      // four times in the lease
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

class BeatEnd {
 public:
  /// Beats in the lease of a participant's instances: who listens takes silence for four fifths of
  /// it for their end, so that two beats may be lost or late.
  static constexpr int beats_per_lease = 4;

  /// Throws std::runtime_error with Cyclone's reason.
  explicit BeatEnd(const dds::Participant& participant)
      : writer_(participant, participant.options().fabric) {}

  /// Fails for too many loads or calls. From any thread.
  tl::expected<void, std::string> publish(const Beat& beat) { return writer_.write(beat); }

 private:
  wire::Writer<Beat> writer_;
};

}  // namespace millrace::fabric::ends
