// The ADS client options for a machine's controller.
#pragma once

#include "cnc/ads/client.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::settings {

inline cnc::ads::ClientOptions client_options(const MachineSettings& settings) {
  cnc::ads::ClientOptions options;
  options.host = settings.controller.host;
  options.tcp_port = settings.controller.tcp_port;
  options.target = settings.controller.net_id;
  options.source.net_id = settings.controller.source;
  options.security = settings.controller.security;
  return options;
}

}  // namespace millrace::gateway::settings
