// The handler of one script.
#pragma once

#include <memory>
#include <mutex>

#include "base/program/log.hpp"
#include "services/batch/script.hpp"
#include "services/sdk/call.hpp"

namespace millrace::services::batch {

/// A script that may be replaced while calls run; each call runs the script that was current when
/// it began.
class CurrentScript {
 public:
  explicit CurrentScript(Script script) : script_(std::move(script)) {}
  [[nodiscard]] Script get() const;
  void set(Script script);

 private:
  mutable std::mutex lock_;
  Script script_;
};

/// Runs the script for each call; a cancelled call ends its process.
sdk::Handler answering(std::shared_ptr<const CurrentScript> script, base::program::Log log);

}  // namespace millrace::services::batch
