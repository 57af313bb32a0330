// The endpoint that publishes machine data and NC programs: of a gateway, or of a replay.
//
//   DataEndpoint end(participant);
//   end.publish(sample);
//   end.unregister(sample);            // the group is not ours any more
//
// Its writers keep the last samples and never wait for a reader.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "fabric/data.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

class DataEndpoint {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit DataEndpoint(const dds::Participant& participant)
      : samples_(participant, participant.options().fabric),
        programs_(participant, participant.options().fabric) {}

  /// An error (a name too long) costs one sample.
  tl::expected<void, std::string> publish(const DataSample& sample) {
    return samples_.write(sample);
  }
  tl::expected<void, std::string> publish(const ProgramEvent& event) {
    return programs_.write(event);
  }
  /// Unregisters the group, or the channel's programs.
  void unregister(const DataSample& sample) { samples_.unregister(sample); }
  void unregister(const ProgramEvent& event) { programs_.unregister(event); }

 private:
  wire::Writer<DataSample> samples_;
  wire::Writer<ProgramEvent> programs_;
};

}  // namespace millrace::fabric::endpoints
