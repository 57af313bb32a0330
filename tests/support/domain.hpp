// A DDS domain for one test, so that tests that run at the same time do not hear each other.
//
//   Domain domain;
//   fabric::dds::Participant participant({.domain = domain.number()});
#pragma once

#include <cstdint>

namespace millrace::tests {

/// Reserves a free domain of this host until it is destroyed. Each domain has a lock file in the
/// folder for temporary files, which all processes share. Throws std::runtime_error when all
/// domains are reserved.
class Domain {
 public:
  Domain();
  ~Domain();
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  /// Never 0, the domain of a millrace in use.
  [[nodiscard]] std::uint32_t number() const { return number_; }

 private:
  std::uint32_t number_ = 0;
  int lock_ = -1;
};

}  // namespace millrace::tests
