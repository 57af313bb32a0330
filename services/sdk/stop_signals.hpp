// How an operator or systemd ends a service: SIGTERM or SIGINT to leave after the running calls, a
// second one to leave at once.
//
//   std::optional<Service> service;
//   StopSignals signals(log);          // from here on no signal kills in the middle of a call
//   service.emplace(…);
//   signals.on_stop([&] { service->stop(); });
#pragma once

#include <csignal>
#include <functional>
#include <memory>
#include <vector>

#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

/// Takes its signals while it lives, on a thread of its own.
class StopSignals {
 public:
  explicit StopSignals(Service::Log log, const std::vector<int>& signals = {SIGTERM, SIGINT});
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Calls `stop` for the first signal, at once if that has come already. The second signal ends
  /// the process with exit code 1, like a crash: other instances get its calls.
  void on_stop(std::function<void()> stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk
