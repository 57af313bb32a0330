// Texts for people: a gateway's words about a call in logs, status and events.
#pragma once

#include <string>
#include <string_view>

#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {

/// Text from a controller made fit for a line of a log: what is not printable ASCII becomes '?'.
std::string printable(std::string_view text);
/// The same for each text of a message from another process.
fabric::Message printable_message(const fabric::Message& message);

/// Why a call that is not pending any more is over.
fabric::Message end_reason(RequestStatus status, const ServiceSnapshot& snapshot);

}  // namespace millrace::gateway
