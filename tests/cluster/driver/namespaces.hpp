// Hosts as network namespaces of this machine; programs are ordinary processes in them.
#pragma once

#include "tests/cluster/driver/hosts.hpp"

namespace millrace::tests::cluster {

/// Needs root and iproute2. The namespaces are called millrace-PID-HOST. This object removes them;
/// the next run removes those of killed runs.
class Namespaces : public Hosts {
 public:
  Namespaces(const std::vector<std::string>& names, std::uint64_t seed);
  ~Namespaces() override;

  std::unique_ptr<Task> up(const std::string& host, const std::string& program,
                           const std::vector<std::string>& arguments) override;

  /// The reason why they are unavailable here; empty if they are available.
  static std::string obstacle();

 private:
  [[nodiscard]] std::string network_namespace(const std::string& host) const;
  void make_namespace(const std::string& host);
  void configure(const std::string& host);
  void remove_all() noexcept;

  const std::string prefix_;
  const std::vector<std::string> names_;
};

}  // namespace millrace::tests::cluster
