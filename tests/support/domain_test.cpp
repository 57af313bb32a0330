#include "tests/support/domain.hpp"

#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace millrace::tests {
namespace {

TEST(Domain, GivesEachHolderItsOwn) {
  std::vector<std::unique_ptr<Domain>> sut;
  std::set<std::uint32_t> numbers;
  for (int i = 0; i < 5; ++i) {
    sut.push_back(std::make_unique<Domain>());
    numbers.insert(sut.back()->number());
  }
  EXPECT_EQ(numbers.size(), sut.size());
  EXPECT_FALSE(numbers.contains(0));
}

}  // namespace
}  // namespace millrace::tests
