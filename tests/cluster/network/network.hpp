// A network between namespaces of this machine: one TAP device in each, all on one Switch.
//
//   Network network({{"gateway", "/run/netns/x-gateway"}, …}, seed);    // each has an eth0 now
//   network.cut("service-1");
//
// Needs root. The network has no connection to the outside.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/cluster/network/switch.hpp"

namespace millrace::tests::cluster {

struct Port {
  /// The name of the host.
  std::string host;
  /// Its network namespace, as a file.
  std::filesystem::path network_namespace;
  /// The new device; down and without an address.
  std::string device = "eth0";
};

class Network {
 public:
  /// Throws std::system_error if a device cannot be made.
  Network(std::vector<Port> ports, std::uint64_t seed);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  /// The host neither sends nor receives.
  void cut(const std::string& host);
  /// Nothing gets from one host to the other.
  void cut_one_way(const std::string& from, const std::string& to);
  /// The host neither sends nor receives multicast.
  void stop_multicast(const std::string& host);
  /// Undoes every cut.
  void heal();
  /// All connections lose this share of their frames, 0 to 1.
  void loss(double share);
  /// All connections delay frames by delay ± jitter.
  void delay(std::chrono::microseconds delay, std::chrono::microseconds jitter);

  [[nodiscard]] Switch::Counters counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests::cluster
