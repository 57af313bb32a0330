// Why a client has no link, in words for the operator: what happened, and what to look at.
#pragma once

#include "cnc/ads/client.hpp"
#include "cnc/ads/link.hpp"

namespace millrace::cnc::ads {

/// An established link has ended.
LinkError explain_end(const ClientOptions& options, const LinkEnd& end);
/// TCP connected, but the first request was not answered by a state: `answer` is what came of it,
/// `end` how the connection ended if it did.
LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address);
/// No TCP connection, for the reason that dial() gave.
LinkError explain_no_connection(const ClientOptions& options, const std::string& reason);

}  // namespace millrace::cnc::ads
