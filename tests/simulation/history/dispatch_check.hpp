// A call goes to one instance that is present, takes new calls and has room for it.
#pragma once

#include <vector>

#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class DispatchCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;
};

}  // namespace millrace::tests::simulation
