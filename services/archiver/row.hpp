// What is written to the archive.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "fabric/data.hpp"
#include "services/archiver/request.hpp"

namespace millrace::services::archiver {

/// What an NC program gave; one per call.
struct Put {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  /// When the archiver had it.
  fabric::Time at{};
  /// V.G.SERVICE.REQUEST_STATE.
  std::uint32_t state = 0;
  /// The whole request, in UTF-8.
  std::string text{};
  /// In UTF-8.
  std::vector<Field> fields{};
  bool replayed = false;
};

struct EventRow {
  fabric::Event event{};
  /// Otherwise who, when and how long are kept, but not what was said.
  bool with_text = true;
};

/// Texts of events, states and data are as on the fabric, CP1252; the archive holds UTF-8.
using Row =
    std::variant<Put, EventRow, fabric::ChannelStatus, fabric::DataSample, fabric::ProgramEvent>;

}  // namespace millrace::services::archiver
