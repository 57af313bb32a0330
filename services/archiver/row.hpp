// The rows of the archive.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "fabric/data.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::archiver {

using Field = text::Field;

/// The data that an NC program sent; one per call.
struct Put {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  /// When the archiver received it.
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
  /// False: the row has all columns except the text of the event.
  bool with_text = true;
};

/// Texts of events, states and data are in CP1252, as on the fabric; the archive stores UTF-8.
using Row =
    std::variant<Put, EventRow, fabric::ChannelStatus, fabric::DataSample, fabric::ProgramEvent>;

}  // namespace millrace::services::archiver
