// The end of who tells of machine data and programs: a gateway, or a replay.
//
//   DataEnd end(participant);
//   end.publish(sample);
//   end.let_go(sample);            // the group is not ours any more
//
// Its writers keep the last samples and never wait for a reader.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "fabric/data.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

class DataEnd {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit DataEnd(const dds::Participant& participant)
      : samples_(participant, participant.options().fabric),
        programs_(participant, participant.options().fabric) {}

  /// An error (a name too long) costs one sample.
  tl::expected<void, std::string> publish(const DataSample& sample) {
    return samples_.write(sample);
  }
  tl::expected<void, std::string> publish(const ProgramEvent& event) {
    return programs_.write(event);
  }
  /// Has nothing more to tell of the group, or of the channel's programs.
  void let_go(const DataSample& sample) { samples_.let_go(sample); }
  void let_go(const ProgramEvent& event) { programs_.let_go(event); }

 private:
  wire::Writer<DataSample> samples_;
  wire::Writer<ProgramEvent> programs_;
};

}  // namespace millrace::fabric::ends
