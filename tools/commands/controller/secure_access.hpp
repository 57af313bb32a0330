// The common parts of the controller commands: Secure ADS, and blocks for gateway.textproto.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"
#include "idl/gateway.pb.h"

namespace millrace::tools::commands::controller {

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
