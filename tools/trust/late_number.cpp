#include "tools/trust/late_number.hpp"

#include <array>
#include <cassert>
#include <cstdint>

#include <fmt/format.h>
#include <openssl/sha.h>

namespace millrace::tools::trust {

namespace {

constexpr std::uint32_t numbers = 100'000'000;

bool is_high(const std::string& encoded) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what SHA256() takes.
  SHA256(reinterpret_cast<const unsigned char*>(encoded.data()), encoded.size(), hash.data());
  constexpr unsigned char ones = 0xff;
  constexpr unsigned char high_half = 0xf0;
  return hash[0] == ones && hash[1] == ones && (hash[2] & high_half) == high_half;
}

}  // namespace

std::string late_number(base::openssl::Subject subject) {
  subject.number = fmt::format("{:08}", 0);
  std::string encoded = base::openssl::encoded_name(subject);
  // It comes last, so what is encoded ends with its digits.
  const std::size_t at = encoded.size() - subject.number.size();
  assert(encoded.substr(at) == subject.number);
  for (std::uint32_t number = 0; number < numbers; ++number) {
    encoded.replace(at, subject.number.size(), fmt::format("{:08}", number));
    if (is_high(encoded)) {
      break;
    }
  }
  return encoded.substr(at);
}

}  // namespace millrace::tools::trust
