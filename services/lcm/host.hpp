// The programs of LCM on the fabric: carries out what the bridge decides.
//
//   Host host(config, options, log);
//   host.run();       // until stop() and the calls under way are answered
#pragma once

#include <memory>

#include "base/program/log.hpp"
#include "services/lcm/config.hpp"
#include "services/lcm/socket.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::lcm {

class Host {
 public:
  /// `base`: the member that all instances are of, and their version. Throws std::runtime_error if
  /// LCM's group cannot be joined.
  Host(const Config& config, sdk::ServiceOptions base, base::program::Log log);
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Once.
  void run();
  /// Asks for no new call, and ends run() when those under way are answered. From any thread.
  void stop();

  /// For others who show something on LCM; from any thread.
  [[nodiscard]] Socket& socket();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::lcm
