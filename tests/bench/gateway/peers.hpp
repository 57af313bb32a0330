// The other side of each measurement, a separate process: `gateway_bench --peer KIND …` prints a
// line "ready" and runs until it is killed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/process.hpp"

namespace millrace::bench {

inline const std::string bench_uuid = "be4c4000-0000-4000-8000-000000000001";

struct PeerOptions {
  std::string kind;
  std::uint32_t domain = 0;
  /// raw: the first peer of this process; polling: services; others: port.
  std::uint32_t number = 0;
  /// raw: peers in this process; services of the library: instances in this process.
  std::uint32_t count = 1;
  std::uint32_t concurrency = 1;
  std::uint32_t channels = 1;
  std::uint32_t period_ms = 2;
  std::uint16_t port = 0;
  /// gateway: the numbers of machines and UUIDs.
  std::uint32_t machines = 1;
  std::uint32_t uuids = 0;
  /// services of the library, gateway: the network interface; empty: the loopback.
  std::string interface {};
};

/// The UUIDs of the services of a peer of the kind "uuids".
std::vector<std::string> numbered_uuids(std::uint32_t count);
/// Makes a participant use the network interface; nothing if it is empty.
std::string dds_configuration(const std::string& interface);

/// `count` services of the library that answer at once, from their own thread (kind "service") or
/// from the receiving one ("inline"; "uuids": each with its own UUID), or after a minute ("stuck").
void serve_sdk(const PeerOptions& options);
/// Bare Cyclone readers and writers that answer in the listener, on one participant (kind "raw").
void serve_raw(const PeerOptions& options);
/// The vendor's design: services that poll every channel of the controller themselves (kind
/// "polling"); `number` services in this process, each with its own connection.
void serve_polling(const PeerOptions& options);
void serve_grpc(const PeerOptions& options);
void serve_lcm(const PeerOptions& options);
/// Sends each datagram back.
void serve_udp(const PeerOptions& options);
/// Echoes in a NATS queue group, with a subscription for each of `count`, through the server at
/// `port`.
void serve_nats(const PeerOptions& options);

/// A gateway with its controllers in memory (kind "gateway"): measurements.hpp.
void serve_gateway(const PeerOptions& options);

/// The arguments that start one, after the name of this program.
std::vector<std::string> peer_arguments(const PeerOptions& options);
/// Starts one and waits until it is ready.
tests::Process start_peer(const PeerOptions& options);
/// Starts one of the library and waits until it is ready.
tests::Process start_service(std::uint32_t domain, std::uint32_t concurrency,
                             const std::string& kind = "service");
/// Starts one without waiting; it prints "ready" later.
tests::Process launch_peer(const PeerOptions& options);
/// Reports to the parent process that this peer is ready.
void peer_is_ready(const std::string& word = {});
/// Never returns: a peer is killed.
void wait_for_ever();

struct Datagrams {
  /// Between two processes.
  Series round_trips;
  /// Processor time to send and receive one in one thread.
  double microseconds = 0;
};
/// What each message of DDS costs at least: `count` of `size` bytes over the loopback.
Datagrams measure_datagrams(std::size_t count, std::size_t size);

// Round trips of other systems on this host, with messages of `size` bytes both ways. Nothing if
// they are not built in, or do not work here.

std::optional<Series> measure_grpc(std::size_t calls, std::size_t size);
std::optional<Series> measure_lcm(std::size_t calls, std::size_t size);

struct NatsLoad {
  std::size_t calls = 0;
  std::size_t in_flight = 1;
  std::size_t size = 200;
  std::uint32_t instances = 1;
  std::uint32_t processes = 1;
};
struct NatsResult {
  RawResult requester;
  // Processor time of each call, in microseconds.
  double server = 0;
  double peers = 0;
};
/// Requests through a server to a queue group.
std::optional<NatsResult> measure_nats(const NatsLoad& load);

}  // namespace millrace::bench
