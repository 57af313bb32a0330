// The ADS client options for a machine's controller.
#pragma once

#include "cnc/ads/client.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::settings {

inline cnc::ads::ClientOptions client_options(const MachineSettings& settings) {
  cnc::ads::ClientOptions options;
  options.host = settings.host;
  options.tcp_port = settings.tcp_port;
  options.target = settings.net_id;
  options.source.net_id = settings.source;
  options.security = settings.security;
  return options;
}

}  // namespace millrace::gateway::settings
