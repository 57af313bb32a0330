// Participants that communicate over sockets like two processes, in one test.
#pragma once

#include <fmt/format.h>

#include "fabric/dds/participant.hpp"
#include "tests/support/domain.hpp"

namespace millrace::fabric {

/// Cyclone has a shortcut between participants of one domain object; these have two objects, on one
/// DDS domain of the network.
class TwoProcesses {
 public:
  [[nodiscard]] dds::ParticipantOptions here() const { return {.domain = here_.number()}; }

  [[nodiscard]] dds::ParticipantOptions there() const {
    return {.domain = there_.number(),
            .configuration = fmt::format(
                "<Discovery><ExternalDomainId>{}</ExternalDomainId></Discovery>", here_.number())};
  }

 private:
  tests::Domain here_;
  tests::Domain there_;
};

}  // namespace millrace::fabric
