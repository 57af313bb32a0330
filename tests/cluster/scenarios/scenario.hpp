// The common part of the scenarios: each runs on network namespaces, and with docker/test on
// containers.
#pragma once

#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/cluster/plant.hpp"

namespace millrace::tests::cluster {

/// Skips the test, with the reason, where its back end cannot run. Prints the output of all
/// programs if the test failed, or if MILLRACE_CLUSTER_LOGS is set.
class Scenario : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    if (const std::string reason = obstacle(GetParam()); !reason.empty()) {
      GTEST_SKIP() << reason;
    }
    plant_ = std::make_unique<Plant>(GetParam());
  }

  void TearDown() override {
    if (plant_ && (HasFailure() || std::getenv("MILLRACE_CLUSTER_LOGS") != nullptr)) {
      std::cout << plant_->logs();
    }
  }

  Plant& sut() { return *plant_; }

 private:
  std::unique_ptr<Plant> plant_;
};

inline const std::vector<Backend> backends = backends_here();

inline std::string name_of(const testing::TestParamInfo<Backend>& info) {
  switch (info.param) {
    case Backend::namespaces:
      return "OnNamespaces";
    case Backend::containers:
      return "OnContainers";
  }
  return {};
}

}  // namespace millrace::tests::cluster
