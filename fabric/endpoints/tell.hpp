// Calls of a listener that may destroy the endpoint in any of its functions.
#pragma once

#include <utility>

namespace millrace::fabric::endpoints {

/// Nothing if the endpoint is closed, which sets its listener to null.
template <typename Listener, typename... Parameters, typename... Arguments>
void tell(Listener* listener, void (Listener::*function)(Parameters...), Arguments&&... arguments) {
  if (listener != nullptr) {
    (listener->*function)(std::forward<Arguments>(arguments)...);
  }
}

}  // namespace millrace::fabric::endpoints
