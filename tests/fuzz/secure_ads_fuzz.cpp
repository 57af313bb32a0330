// Messages before an ADS connection: TlsConnectInfo, and messages over UDP. What parses is written
// back as the same bytes, except unused ones.
#include <cstdlib>

#include "cnc/ads/connect_info.hpp"
#include "cnc/ads/discovery.hpp"

namespace {

using namespace millrace::cnc::ads;

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void read_connect_info(BytesView bytes) {
  const auto info = decode_connect_info(bytes);
  if (!info) {
    return;
  }
  const Bytes again = encode(*info);
  require(again.size() == bytes.size());
  require(decode_connect_info(again) == *info);
}

void read_datagram(BytesView bytes) {
  const auto datagram = decode_datagram(bytes);
  if (!datagram) {
    return;
  }
  require(decode_datagram(encode(*datagram)) == *datagram);
  if (const auto route = route_request_of(*datagram)) {
    require(route_request_of(encode(datagram->invoke_id, *route)) == route);
  }
  static_cast<void>(identity_of(*datagram));
  static_cast<void>(route_status_of(*datagram));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read_connect_info({data, size});
  read_datagram({data, size});
  return 0;
}
