// Texts for people: a gateway's words about a call in logs, status and events.
#pragma once

#include <string>
#include <string_view>

#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {

/// Text from a controller made fit for a line of a log: what is not printable ASCII becomes '?'.
std::string printable(std::string_view text);

/// At most 255 bytes, the size of a reason or detail on the fabric; a longer text ends in "...".
std::string truncate_reason(std::string text);

/// Why a call that is not pending any more is over.
std::string end_reason(RequestStatus status, const ServiceSnapshot& snapshot);

}  // namespace millrace::gateway
