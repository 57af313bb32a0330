#include "tests/support/data.hpp"

namespace millrace::tests {

std::filesystem::path test_data(std::string_view name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / name;
}

}  // namespace millrace::tests
