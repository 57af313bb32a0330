// Explains to the operator why a client has no connection: what happened, and what to check.
#pragma once

#include "cnc/ads/client.hpp"
#include "cnc/ads/link.hpp"

namespace millrace::cnc::ads {

/// For the end of an established connection.
LinkError explain_end(const ClientOptions& options, const LinkEnd& end);
/// For a TCP connection whose first request did not return a state: `answer` is its error, `end` is
/// how the connection ended if it did.
LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address);
/// For a failed TCP connection, with the reason that dial() returned.
LinkError explain_no_connection(const ClientOptions& options, const std::string& reason);

}  // namespace millrace::cnc::ads
