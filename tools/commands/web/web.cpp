#include "tools/commands/web/web.hpp"

#include <set>
#include <sstream>
#include <string>

#include <boost/asio/ip/address.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "base/program/version.hpp"
#include "base/text/ascii.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/doctor/doctor.hpp"
#include "tools/web/actions/users.hpp"
#include "tools/web/live/web.hpp"

namespace millrace::tools::commands::web {

namespace {

// `millrace web --hash-password`.

/// Reads a line from standard input, without echo on a terminal, and prints its hash; returns the
/// exit code.
int print_hash() {
  const std::string password = read_hidden("Password");
  if (password.empty()) {
    throw base::program::UsageError("--hash-password: expected a password on standard input");
  }
  fmt::print("{}\n", tools::web::actions::hash_of(password));
  return base::program::exit_done;
}

namespace program = base::program;
using tools::web::live::WebOptions;

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace web"}) {}

  fabric::profile::FabricFlags fabric;
  std::string listen = "127.0.0.1:8080";
  std::string certificate;
  std::string key;
  bool behind_proxy = false;
  std::string recordings;
  bool login_for_recordings = false;
  std::vector<std::string> names;
  std::vector<std::string> trusted_proxies;
  std::string users;
  std::string state_folder;
  std::vector<std::string> normal_states;
  bool hash_password = false;
  spdlog::level::level_enum level = spdlog::level::info;
};

struct Place {
  boost::asio::ip::address address;
  std::uint16_t port = 0;
};

/// "127.0.0.1:8080", "[::1]:8080".
Place place_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) {
    host = host.substr(1, host.size() - 2);
  }
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  const auto port = colon == std::string::npos
                        ? std::nullopt
                        : base::text::parse_number<std::uint16_t>(text.substr(colon + 1));
  if (error || !port) {
    throw program::UsageError(
        fmt::format("--listen {}: expected an address of this host and a port, as in "
                    "127.0.0.1:8080",
                    text));
  }
  return {address, *port};
}

/// "UUID=2,3", each.
tools::web::plant::NormalStates normal_states_of(const std::vector<std::string>& texts) {
  tools::web::plant::NormalStates normal;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    std::set<std::uint32_t>& states = normal.more[fabric::canonical_uuid(text.substr(0, equals))];
    std::istringstream list(equals == std::string::npos ? "" : text.substr(equals + 1));
    for (std::string address; std::getline(list, address, ',');) {
      const auto state = base::text::parse_number<std::uint32_t>(address);
      if (!state) {
        states.clear();
        break;
      }
      states.insert(*state);
    }
    if (states.empty()) {
      throw program::UsageError(
          fmt::format("--normal-state {}: expected a UUID and states, as in "
                      "b536e110-ca9e-4198-bddb-64331366bedb=2,3",
                      text));
    }
  }
  return normal;
}

WebOptions web_options(const Options& options) {
  const Place place = place_of(options.listen);
  if (options.certificate.empty() != options.key.empty()) {
    throw program::UsageError("--tls-cert needs --tls-key, and the other way round");
  }
  if (!place.address.is_loopback() && options.certificate.empty() && !options.behind_proxy) {
    throw program::UsageError(
        fmt::format("--listen {}: other hosts may connect only with --tls-cert and --tls-key, or "
                    "with --behind-proxy if only a TLS proxy can connect",
                    options.listen));
  }
  if (!options.recordings.empty() && !std::filesystem::is_directory(options.recordings)) {
    throw program::UsageError(
        fmt::format("--recordings {}: the folder does not exist", options.recordings));
  }
  if (options.login_for_recordings && options.users.empty()) {
    throw program::UsageError(
        "--login-for-recordings: expected the file with the users (--allow-actions)");
  }
  WebOptions web{.join = options.fabric.options(), .version = program::version()};
  web.joining = doctor::joining_of(options.fabric, web.join);
  web.server.address = place.address.to_string();
  web.server.port = place.port;
  web.server.certificate = options.certificate;
  web.server.key = options.key;
  for (const std::string& text : options.trusted_proxies) {
    boost::system::error_code no_address;
    const auto address = boost::asio::ip::make_address(text, no_address);
    if (no_address) {
      throw program::UsageError(
          fmt::format("--trusted-proxy {}: expected an IP address, as in 127.0.0.1", text));
    }
    web.server.trusted_proxies.insert(address.to_string());
  }
  web.behind_proxy = options.behind_proxy;
  web.recordings = options.recordings;
  web.login_for_recordings = options.login_for_recordings;
  web.state_folder = options.state_folder;
  if (!options.users.empty()) {
    auto users = tools::web::actions::read_users(options.users);
    if (!users) {
      throw program::UsageError(users.error());
    }
    web.users = std::move(*users);
  }
  web.normal_states = normal_states_of(options.normal_states);
  web.names = {options.names.begin(), options.names.end()};
  return web;
}

int serve(const Options& options) {
  if (options.hash_password) {
    return print_hash();
  }
  const WebOptions wanted = web_options(options);
  const bool is_v6 = wanted.server.address.find(':') != std::string::npos;
  tools::web::live::serve(wanted, program::make_log("web", options.level), [&](std::uint16_t port) {
    program::ready(fmt::format("fabric {} on domain {} at {}://{}{}{}:{}/", wanted.join.fabric,
                               wanted.join.domain,
                               wanted.server.certificate.empty() ? "http" : "https",
                               is_v6 ? "[" : "", wanted.server.address, is_v6 ? "]" : "", port));
  });
  return program::exit_done;
}

}  // namespace

void add_web(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "web", "Serve the web page and the metrics for Prometheus, until interrupted",
      "millrace web --listen 127.0.0.1:8080 --recordings /var/lib/millrace/recorder");
  auto options = std::make_shared<Options>(command);
  command.add_option("--listen", options->listen, "Address and port; port 0 = any free one")
      ->type_name("ADDRESS:PORT")
      ->capture_default_str();
  command.add_option("--recordings", options->recordings, "Show the recordings of this folder")
      ->type_name("DIR");
  command
      .add_option("--allow-actions", options->users,
                  "Let the users in this file answer, retry and drain; without it no user may")
      ->type_name("FILE");
  command.add_flag("--login-for-recordings", options->login_for_recordings,
                   "Show recordings only to users of --allow-actions who have logged in");
  command
      .add_option("--state-folder", options->state_folder,
                  "Keep acknowledgements in this folder, so that they survive a restart")
      ->type_name("DIR");
  command.add_flag(
      "--hash-password", options->hash_password,
      "Read a password from standard input and print its hash for the file of --allow-actions");
  command
      .add_option("--tls-cert", options->certificate,
                  "Certificate and chain (PEM) for HTTPS; then other hosts may connect")
      ->type_name("FILE");
  command.add_option("--tls-key", options->key, "The certificate's key (PEM)")->type_name("FILE");
  command.add_flag("--behind-proxy", options->behind_proxy,
                   "Accept other hosts without TLS, behind a TLS proxy");
  command
      .add_option("--trusted-proxy", options->trusted_proxies,
                  "Address of a proxy whose X-Forwarded-For names the client, for the limit of "
                  "wrong passwords; may be repeated")
      ->type_name("ADDRESS")
      ->allow_extra_args(false);
  command.add_option("--name", options->names,
                     "A further name of this server in browsers, after its addresses and its "
                     "host's name; may be repeated");
  command
      .add_option("--normal-state", options->normal_states,
                  "States of a service that are not errors, as well as 1 (and 0 if the NC program "
                  "waits for RESPONSE); may be repeated")
      ->type_name("UUID=STATE,...")
      ->allow_extra_args(false);
  program::add_log_level(command, options->level);
  run_if_chosen(command, chosen, options, serve);
}

}  // namespace millrace::tools::commands::web
