// Requests to AMS routers over UDP, and their responses.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/udp.hpp>

#include "cnc/ads/discovery.hpp"

namespace millrace::tools::commands::controller {

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

}  // namespace millrace::tools::commands::controller
