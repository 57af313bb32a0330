// LCM request and response: two channels over UDP multicast with time-to-live 0, which stays on
// this host.
#include <lcm/lcm.h>

#include "tests/bench/gateway/peers.hpp"

namespace millrace::bench {

namespace {

constexpr const char* address = "udpm://239.255.76.67:7667?ttl=0";
constexpr int patience_ms = 2000;

void echo(const lcm_recv_buf_t* received, const char*, void* lcm) {
  lcm_publish(static_cast<lcm_t*>(lcm), "reply", received->data, received->data_size);
}

void note(const lcm_recv_buf_t*, const char*, void* arrived) {
  *static_cast<bool*>(arrived) = true;
}

}  // namespace

void serve_lcm(const PeerOptions&) {
  lcm_t* const lcm = lcm_create(address);
  if (lcm == nullptr) {
    return;
  }
  lcm_subscribe(lcm, "request", &echo, lcm);
  peer_is_ready();
  while (lcm_handle(lcm) == 0) {
  }
}

std::optional<Series> measure_lcm(std::size_t calls, std::size_t size) {
  PeerOptions options;
  options.kind = "lcm";
  tests::Process peer = start_peer(options);
  lcm_t* const lcm = lcm_create(address);
  if (lcm == nullptr) {
    return std::nullopt;
  }
  bool arrived = false;
  lcm_subscribe(lcm, "reply", &note, &arrived);
  const std::string request(size, 'x');
  Series series;
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    arrived = false;
    const auto start = Clock::now();
    lcm_publish(lcm, "request", request.data(), static_cast<unsigned>(request.size()));
    while (!arrived) {
      if (lcm_handle_timeout(lcm, patience_ms) <= 0) {
        lcm_destroy(lcm);
        return std::nullopt;
      }
    }
    if (i >= calls / 10) {
      series.add(Clock::now() - start);
    }
  }
  lcm_destroy(lcm);
  return series;
}

}  // namespace millrace::bench
