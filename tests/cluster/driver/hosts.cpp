#include "tests/cluster/driver/hosts.hpp"

#include <stdexcept>

#include "tests/cluster/driver/namespaces.hpp"

namespace millrace::tests::cluster {

std::unique_ptr<Hosts> make_hosts(Backend backend, const std::vector<std::string>& names,
                                  std::uint64_t seed) {
  if (const std::string reason = obstacle(backend); !reason.empty()) {
    throw std::runtime_error(reason);
  }
  return std::make_unique<Namespaces>(names, seed);
}

std::string obstacle(Backend backend) {
  switch (backend) {
    case Backend::namespaces:
      return Namespaces::obstacle();
  }
  return {};
}

}  // namespace millrace::tests::cluster
