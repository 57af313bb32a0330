// Hosts as containers on a compose network whose bridge is replaced by our switch. Programs run in
// the images of docker/Dockerfile, each in a container that shares its host's network.
#pragma once

#include <map>

#include "tests/cluster/driver/hosts.hpp"

namespace millrace::tests::cluster {

/// Needs the engine and the images of docker/test, which names the engine's folder in
/// MILLRACE_ENGINE.
class Containers : public Hosts {
 public:
  Containers(const std::vector<std::string>& names, std::uint64_t seed);
  ~Containers() override;

  std::unique_ptr<Task> up(const std::string& host, const std::string& program,
                           const std::vector<std::string>& arguments) override;

  /// The reason why they are unavailable here; empty if they are available.
  static std::string obstacle();

 private:
  [[nodiscard]] std::string container(const std::string& host) const;
  void write_compose_file(const std::vector<std::string>& names) const;
  void compose(std::vector<std::string> arguments) const;
  /// Moves the host from the network's bridge to a port of our switch.
  void connect(const Port& port);
  void remove_all() noexcept;

  /// The engine's, with its name for `ip`.
  const std::string network_namespace_;
  const std::string project_;
  /// By host.
  std::map<std::string, std::string> bridges_;
  int tasks_ = 0;
};

}  // namespace millrace::tests::cluster
