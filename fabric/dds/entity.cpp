#include "fabric/dds/entity.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace millrace::fabric::dds {

dds_return_t check(dds_return_t result, std::string_view what) {
  if (result < 0) {
    throw std::runtime_error(fmt::format("cannot {}: {}", what, dds_strretcode(result)));
  }
  return result;
}

}  // namespace millrace::fabric::dds
