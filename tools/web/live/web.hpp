// A running `millrace web`: an observer of the fabric and a server for browsers, in one loop.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/doctor/findings.hpp"
#include "tools/web/actions/users.hpp"
#include "tools/web/live/server.hpp"
#include "tools/web/plant/call_store.hpp"

namespace millrace::tools::web::live {

struct WebOptions {
  fabric::dds::ParticipantOptions join{};
  /// How the doctor joins the fabric.
  doctor::Joining joining{};
  ServerOptions server{};
  /// Empty: no recordings.
  std::filesystem::path recordings{};
  /// Recordings are for logged-in users only.
  bool login_for_recordings = false;
  /// Users who may act; without any, actions are off.
  actions::Users users{};
  /// Keeps acknowledgements; empty: they end with this server.
  std::filesystem::path state_folder{};
  /// A proxy does TLS.
  bool behind_proxy = false;
  /// Which states of services are not errors.
  plant::NormalStates normal_states{};
  /// Further host names of this server, besides its addresses, "localhost" and this host's name.
  std::set<std::string> names{};
  std::string version{};
};

/// Serves until SIGINT or SIGTERM; `ready` is called once browsers can connect. Throws
/// std::runtime_error if it cannot join the fabric or cannot listen.
void serve(WebOptions options, base::program::Log log,
           const std::function<void(std::uint16_t port)>& ready);

}  // namespace millrace::tools::web::live
