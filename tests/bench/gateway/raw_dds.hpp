// Bare Cyclone DDS request and reply: the minimum for a call. Each peer has a reader and a writer
// in its own partition; the requester has a writer for each of them.
//
//   RawRequester requester(domain, 4);      // with the peers 0 to 3 (PeerOptions, kind "raw")
//   if (requester.await_peers(limit)) requester.run(10'000, 256, limit);
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "fabric/dds/entity.hpp"
#include "tests/bench/series.hpp"

namespace millrace::bench {

struct RawResult {
  Series round_trips;
  double calls_per_second = 0;
  /// Processor time of this process per call.
  double microseconds_per_call = 0;
};

/// A participant with DDS's default lease and the fabric's configuration of Cyclone, and the
/// endpoints of a raw peer.
class RawEndpoint {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit RawEndpoint(std::uint32_t domain);

  [[nodiscard]] dds_entity_t requests() const { return requests_.handle(); }
  [[nodiscard]] dds_entity_t replies() const { return replies_.handle(); }
  dds_entity_t create_writer(dds_entity_t topic, const std::string& partition) const;
  dds_entity_t create_reader(dds_entity_t topic, const std::string& partition,
                             const dds_listener_t* listener) const;

 private:
  fabric::dds::Entity domain_;
  fabric::dds::Entity participant_;
  fabric::dds::Entity requests_;
  fabric::dds::Entity replies_;
};

/// The partition of a peer.
std::string raw_partition(std::uint32_t peer);

class RawRequester {
 public:
  /// For the peers 0 to `peers` - 1.
  RawRequester(std::uint32_t domain, std::uint32_t peers);
  ~RawRequester();
  RawRequester(const RawRequester&) = delete;
  RawRequester& operator=(const RawRequester&) = delete;

  /// True once all peers are matched, both ways; false when `limit` is over.
  bool await_peers(std::chrono::milliseconds limit);

  /// Makes `calls` calls, `in_flight` at a time, each on its own key; the peers share them evenly.
  /// The next call of a key is written in the listener that got its reply. Nothing if they are not
  /// answered within `limit`; then the requester is unusable.
  std::optional<RawResult> run(std::size_t calls, std::size_t in_flight,
                               std::chrono::milliseconds limit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Makes `calls` calls with `processes` peers that it starts as processes.
RawResult measure_raw(std::uint32_t domain, std::size_t calls, std::size_t in_flight,
                      std::uint32_t processes);

}  // namespace millrace::bench
