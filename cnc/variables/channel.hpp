// The variables of one CNC channel over ADS, by name, as bytes.
//
//   Channel channel(client, 1);
//   auto value = co_await channel.read("V.G.SERVICE.UUID", 256);
//
// The functions and their streams: addresses.hpp and layout.hpp.
#pragma once

#include <string_view>
#include <vector>

#include "cnc/ads/client.hpp"
#include "cnc/ads/sum_codec.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

/// The addresses of a controller's variables, if they differ from the vendor's defaults.
struct Location {
  std::uint16_t port = sda_port;
  /// The index group of channel n is this + n.
  std::uint32_t group = decoder_group;
};

/// The result of each read.
using Answers = std::vector<ads::Result<Bytes>>;

/// Reads all items of a port in one request. A controller without sums refuses the whole request
/// (ads::refuses_sums()).
boost::asio::awaitable<ads::Result<Answers>> read_together(
    ads::Client& client, std::uint16_t port, std::vector<ads::SumItem> items,
    ads::SumOf kind = ads::SumOf::read_writes);

/// The client must outlive the pending requests of the channel. Errors are those of the controller
/// and of the client (error.hpp).
class Channel {
 public:
  /// `number` counts from 1.
  Channel(ads::Client& client, std::uint32_t number, Location location = {})
      : client_(client), port_(location.port), group_(location.group + number), number_(number) {}

  [[nodiscard]] std::uint32_t number() const { return number_; }
  [[nodiscard]] std::uint16_t port() const { return port_; }

  /// Reads at most `length` bytes of the value.
  boost::asio::awaitable<ads::Result<Bytes>> read(std::string_view name, std::uint32_t length);
  /// The value must have the size of the variable.
  boost::asio::awaitable<ads::Result<void>> write(std::string_view name, BytesView value);

  /// The same read as an item of a sum.
  [[nodiscard]] ads::SumItem item(std::string_view name, std::uint32_t length) const;

 private:
  [[nodiscard]] ads::Index at(std::uint32_t offset) const { return {group_, offset}; }

  ads::Client& client_;
  std::uint16_t port_;
  std::uint32_t group_;
  std::uint32_t number_;
};

}  // namespace millrace::cnc::variables
