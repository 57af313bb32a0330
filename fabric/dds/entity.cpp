#include "fabric/dds/entity.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace millrace::fabric::dds {

dds_return_t check(dds_return_t result, std::string_view what) {
  if (result < 0) {
    if (result == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY) {
      throw std::runtime_error(fmt::format(
          "may not {}: the certificate of this program does not say so; `millrace trust show` says "
          "what it may",
          what));
    }
    throw std::runtime_error(fmt::format("cannot {}: {}", what, dds_strretcode(result)));
  }
  return result;
}

}  // namespace millrace::fabric::dds
