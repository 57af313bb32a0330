#include "fabric/dds/entity.hpp"

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace millrace::fabric::dds {

namespace {

/// The role that may write a topic, as in fabric/trust/permissions.cpp; empty if the role alone
/// does not decide. The fabric or the UUID may also be wrong.
std::string role_needed(std::string_view what) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> roles{
      {{"write millrace/v5/command", "operator"},
       {"write millrace/v5/variable/request", "operator"},
       {"write millrace/v5/request", "gateway or tester"},
       {"write millrace/v5/reply", "service with this UUID"},
       {"write millrace/machine", "gateway"}}};
  for (const auto& [topic, role] : roles) {
    if (what.starts_with(topic)) {
      return fmt::format(", it needs the role {}", role);
    }
  }
  return {};
}

}  // namespace

dds_return_t check(dds_return_t result, std::string_view what) {
  if (result < 0) {
    if (result == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY) {
      throw std::runtime_error(
          fmt::format("may not {}: the certificate of this process does not allow it{}; `millrace "
                      "trust show` says what it may",
                      what, role_needed(what)));
    }
    throw std::runtime_error(fmt::format("cannot {}: {}", what, dds_strretcode(result)));
  }
  return result;
}

std::vector<std::string> partitions_of(const dds_qos_t* qos) {
  std::uint32_t count = 0;
  char** names = nullptr;
  std::vector<std::string> all;
  if (dds_qget_partition(qos, &count, &names)) {
    for (std::uint32_t i = 0; i < count; ++i) {
      all.emplace_back(names[i]);
      dds_free(names[i]);
    }
    dds_free(static_cast<void*>(names));
  }
  return all;
}

std::string guid_prefix(const dds_guid_t& guid) {
  const auto word = [&](std::size_t at) {
    return std::uint32_t{guid.v[at]} << 24U | std::uint32_t{guid.v[at + 1]} << 16U |
           std::uint32_t{guid.v[at + 2]} << 8U | guid.v[at + 3];
  };
  return fmt::format("{:x}:{:x}:{:x}", word(0), word(4), word(8));
}

}  // namespace millrace::fabric::dds
