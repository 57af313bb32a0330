// Hosts as containers on a compose network whose bridge is replaced by our switch; programs run in
// the images of docker/Dockerfile, each in a container that shares the network of its host.
#pragma once

#include <map>

#include "tests/cluster/driver/hosts.hpp"

namespace millrace::tests::cluster {

/// Needs the engine and the images that docker/test makes; it names the engine's folder in
/// MILLRACE_ENGINE.
class Containers : public Hosts {
 public:
  Containers(const std::vector<std::string>& names, std::uint64_t seed);
  ~Containers() override;

  std::unique_ptr<Task> up(const std::string& host, const std::string& program,
                           const std::vector<std::string>& arguments) override;

  /// Why there can be none here; empty if there can.
  static std::string obstacle();

 private:
  [[nodiscard]] std::string container(const std::string& host) const;
  void write_compose_file(const std::vector<std::string>& names) const;
  void compose(std::vector<std::string> arguments) const;
  /// Takes the host off the network's bridge, and puts it on a port of our switch.
  void connect(const Port& port);
  void remove_all() noexcept;

  /// Of the engine, as `ip` calls it.
  const std::string network_namespace_;
  const std::string project_;
  /// By host.
  std::map<std::string, std::string> bridges_;
  int tasks_ = 0;
};

}  // namespace millrace::tests::cluster
