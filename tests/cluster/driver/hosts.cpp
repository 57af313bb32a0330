#include "tests/cluster/driver/hosts.hpp"

#include <stdexcept>

#include <fmt/format.h>

#include "tests/cluster/driver/containers.hpp"
#include "tests/cluster/driver/namespaces.hpp"

namespace millrace::tests::cluster {

Hosts::Hosts(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    addresses_[name] = fmt::format("10.77.0.{}", addresses_.size() + 1);
  }
}

std::vector<Backend> backends_here() {
  return {Containers::obstacle().empty() ? Backend::containers : Backend::namespaces};
}

std::unique_ptr<Hosts> make_hosts(Backend backend, const std::vector<std::string>& names,
                                  std::uint64_t seed) {
  if (const std::string reason = obstacle(backend); !reason.empty()) {
    throw std::runtime_error(reason);
  }
  switch (backend) {
    case Backend::namespaces:
      return std::make_unique<Namespaces>(names, seed);
    case Backend::containers:
      return std::make_unique<Containers>(names, seed);
  }
  return {};
}

std::string obstacle(Backend backend) {
  switch (backend) {
    case Backend::namespaces:
      return Namespaces::obstacle();
    case Backend::containers:
      return Containers::obstacle();
  }
  return {};
}

}  // namespace millrace::tests::cluster
