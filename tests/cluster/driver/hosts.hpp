// The interface of all scenarios to their hosts, on a network that a test can cut and degrade. Its
// back ends are driver/namespaces.hpp and driver/containers.hpp.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/cluster/driver/task.hpp"
#include "tests/cluster/network/network.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests::cluster {

class Hosts {
 public:
  explicit Hosts(const std::vector<std::string>& names);
  virtual ~Hosts() = default;
  Hosts(const Hosts&) = delete;
  Hosts& operator=(const Hosts&) = delete;

  /// Starts a program of this build on a host, with folder() at the same path.
  virtual std::unique_ptr<Task> up(const std::string& host, const std::string& program,
                                   const std::vector<std::string>& arguments) = 0;
  /// cut, heal, loss, delay.
  Network& network() { return *network_; }
  /// The IPv4 address of a host; the n-th constructor argument has 10.77.0.n.
  [[nodiscard]] const std::string& address(const std::string& host) const {
    return addresses_.at(host);
  }
  /// For files of this test, shared by all hosts.
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }

 protected:
  /// Made by the back end after the hosts, and destroyed before them.
  std::optional<Network> network_;

 private:
  TemporaryFolder folder_;
  /// By host.
  std::map<std::string, std::string> addresses_;
};

/// The kinds of hosts.
enum class Backend { namespaces, containers };

/// The back ends to test here: containers where docker/test has made an engine, otherwise
/// namespaces.
std::vector<Backend> backends_here();

/// Throws std::runtime_error if the hosts cannot be made.
std::unique_ptr<Hosts> make_hosts(Backend backend, const std::vector<std::string>& names,
                                  std::uint64_t seed);

/// The reason why a back end cannot be used here; empty if it can.
std::string obstacle(Backend backend);

}  // namespace millrace::tests::cluster
