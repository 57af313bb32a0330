#pragma once

#include "services/sdk/call.hpp"

/// Answers with the number of bytes of the request. Replace this by your own work.
///
/// Runs on its own thread, one call after the other (--concurrency N: N at a time). An exception
/// becomes an error response. See docs/how-to/services-in-cpp-and-c.md.
millrace::services::sdk::Response answer(const millrace::services::sdk::Call& call);
