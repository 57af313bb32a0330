// Which addresses count as one host, where each host has a limit.
#pragma once

#include <algorithm>
#include <string>

#include <boost/asio/ip/address.hpp>

namespace millrace::base::loop {

/// An IPv6 address stands for its /64: a host may have all of it.
inline boost::asio::ip::address host_of(const boost::asio::ip::address& address) {
  if (!address.is_v6() || address.to_v6().is_v4_mapped()) {
    return address;
  }
  auto bytes = address.to_v6().to_bytes();
  std::fill(bytes.begin() + bytes.size() / 2, bytes.end(), static_cast<unsigned char>(0));
  return boost::asio::ip::address_v6(bytes);
}

/// The same in text. Any other text stands for itself.
inline std::string host_of(const std::string& address) {
  boost::system::error_code none;
  const auto parsed = boost::asio::ip::make_address(address, none);
  return none ? address : host_of(parsed).to_string();
}

}  // namespace millrace::base::loop
