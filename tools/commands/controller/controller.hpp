// millrace controller: finds controllers on a network, checks what one offers to a gateway, and
// adds a route to this host.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/udp.hpp>

#include "cnc/ads/discovery.hpp"
#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"
#include "idl/gateway.pb.h"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::controller {

void add_controller(CLI::App& app, Chosen& chosen);

void add_find(CLI::App& controller, Chosen& chosen);
void add_probe(CLI::App& controller, Chosen& chosen);
void add_route(CLI::App& controller, Chosen& chosen);

// Requests to AMS routers over UDP, and their responses.

struct Question {
  cnc::ads::Datagram datagram;
  std::vector<boost::asio::ip::udp::endpoint> to;
  /// Ours; unspecified = the system chooses.
  boost::asio::ip::address_v4 from{};
  /// They are broadcast addresses: any host may respond.
  bool broadcast = false;
  std::chrono::milliseconds patience{1000};
};

/// Each response with the address that it came from. Returns when all addresses have responded, or
/// `patience` is over; with a broadcast always after that. Throws std::runtime_error if the network
/// refuses the request.
boost::asio::awaitable<std::vector<std::pair<std::string, cnc::ads::Datagram>>> ask(
    Question question);

// The common parts of the controller commands: Secure ADS, and blocks for gateway.textproto.

/// For a connection, a handshake, and a response over UDP.
inline constexpr std::chrono::seconds time_to_answer{5};

/// Of this host, in the folder that --self-signed names.
std::filesystem::path certificate_in(const std::filesystem::path& folder);
std::filesystem::path key_in(const std::filesystem::path& folder);
/// Both as they are in the files, without a fingerprint.
cnc::ads::SelfSigned certificate_and_key_in(const std::filesystem::path& folder);

/// A connection to the controller's port of Secure ADS. Throws std::runtime_error.
boost::asio::awaitable<cnc::ads::Stream::Socket> secure_connection(std::string host,
                                                                   std::uint16_t port);

/// The fingerprint of the controller's certificate: `given`, or the one that a person confirms.
/// Throws std::runtime_error, and UsageError if `given` is not a fingerprint.
boost::asio::awaitable<std::string> agreed_fingerprint(std::string host, std::uint16_t port,
                                                       std::string given,
                                                       cnc::ads::SelfSigned shown);

/// As a block of gateway.textproto.
std::string block_of(const config::Machine& machine);

}  // namespace millrace::tools::commands::controller
