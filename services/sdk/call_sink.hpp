// The receiver of a call's reports.
#pragma once

#include "fabric/messages.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::sdk {

/// Implemented by the instance that runs the call; its functions may be called from any thread.
class CallSink {
 public:
  virtual ~CallSink() = default;
  /// The response has passed check_text.
  virtual void interim(fabric::CallId call, const Response& response) = 0;
  virtual void finished(fabric::CallId call, const Result& result) = 0;
  /// The handler has not begun it and will not.
  virtual void declined(fabric::CallId call, const std::string& reason) = 0;
};

}  // namespace millrace::services::sdk
