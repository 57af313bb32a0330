// A network between namespaces of this machine: one TAP device in each, all on one Switch.
//
//   Network network({{"gateway", "/run/netns/x-gateway"}, …}, seed);    // each has an eth0 now
//   network.cut("service-1");
//
// Needs root. No way leads out: nothing but these devices is connected.
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
  /// The device that is made there; down and without an address.
  std::string device = "eth0";
};

class Network {
 public:
  /// Throws std::system_error if a device cannot be made.
  Network(std::vector<Port> ports, std::uint64_t seed);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  /// Nothing comes from or gets to the host.
  void cut(const std::string& host);
  /// Nothing gets from one host to the other.
  void cut_one_way(const std::string& from, const std::string& to);
  /// Neither takes multicast from the host nor brings it any.
  void stop_multicast(const std::string& host);
  /// Undoes every cut.
  void heal();
  /// All ways lose this share of their frames, 0 to 1.
  void loss(double share);
  /// All ways take delay ± jitter.
  void delay(std::chrono::microseconds delay, std::chrono::microseconds jitter);

  [[nodiscard]] Switch::Counters counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests::cluster
