// The driver under all scenarios: hosts on a network of their own that can be cut and made bad.
// The back ends: driver/namespaces.hpp, driver/containers.hpp.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/cluster/driver/task.hpp"
#include "tests/cluster/network/network.hpp"

namespace millrace::tests::cluster {

class Hosts {
 public:
  Hosts() = default;
  virtual ~Hosts() = default;
  Hosts(const Hosts&) = delete;
  Hosts& operator=(const Hosts&) = delete;

  /// Starts a program of this build on a host. It finds folder() at the same path.
  virtual std::unique_ptr<Task> up(const std::string& host, const std::string& program,
                                   const std::vector<std::string>& arguments) = 0;
  /// cut, heal, loss, delay.
  virtual Network& network() = 0;
  /// The IPv4 address of a host; the n-th that the hosts were made with has 10.77.0.n.
  [[nodiscard]] virtual std::string address(const std::string& host) const = 0;
  /// For files of this test, shared by all hosts.
  [[nodiscard]] virtual std::filesystem::path folder() const = 0;
};

/// Where the hosts come from.
enum class Backend { namespaces, containers };

/// The back ends to be tested here: containers where docker/test has made an engine, else
/// namespaces.
std::vector<Backend> backends_here();

/// Throws std::runtime_error if the hosts cannot be made.
std::unique_ptr<Hosts> make_hosts(Backend backend, const std::vector<std::string>& names,
                                  std::uint64_t seed);

/// Why a back end cannot be used here; empty if it can.
std::string obstacle(Backend backend);

}  // namespace millrace::tests::cluster
