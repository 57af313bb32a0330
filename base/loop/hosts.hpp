// The hosts of a server's connections, so that none shuts the others out.
//
//   const auto given_up = most_dispensable(half_open, [](const Peer& peer) { return peer.address; });
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

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

/// The connection that a full server gives up for a new one: the first of the host that has the
/// most, so a host that shuts others out closes its own. `candidates` begin with the most
/// dispensable; null if there are none.
template <class Candidate>
std::shared_ptr<Candidate> most_dispensable(
    const std::vector<std::shared_ptr<Candidate>>& candidates, const auto& address_of) {
  std::map<decltype(host_of(address_of(*candidates.front()))), std::size_t> counts;
  for (const auto& candidate : candidates) {
    ++counts[host_of(address_of(*candidate))];
  }
  const auto found = std::ranges::max_element(candidates, {}, [&](const auto& candidate) {
    return counts.at(host_of(address_of(*candidate)));
  });
  return found == candidates.end() ? nullptr : *found;
}

}  // namespace millrace::base::loop
