#include "base/openssl/owner.hpp"

#include <array>
#include <ctime>
#include <new>
#include <stdexcept>

#include <fmt/format.h>
#include <openssl/err.h>

namespace millrace::base::openssl {

BioOwner reading(std::string_view text) {
  BioOwner bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (!bio) {
    throw std::bad_alloc();
  }
  return bio;
}

BioOwner writing() {
  BioOwner bio(BIO_new(BIO_s_mem()));
  if (!bio) {
    throw std::bad_alloc();
  }
  return bio;
}

std::string written(BIO& bio) {
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(&bio, &bytes);
  return size > 0 ? std::string(bytes, static_cast<std::size_t>(size)) : std::string{};
}

void expect(bool done, std::string_view what) {
  if (!done) {
    throw std::invalid_argument(fmt::format("{}: {}", what, last_reason()));
  }
}

std::chrono::sys_seconds time_of(const ASN1_TIME* field) {
  std::tm parts{};
  if (field == nullptr || ASN1_TIME_to_tm(field, &parts) != 1) {
    return {};
  }
  return std::chrono::time_point_cast<std::chrono::seconds>(
      std::chrono::system_clock::from_time_t(::timegm(&parts)));
}

std::string last_reason() {
  const unsigned long code = ERR_peek_last_error();
  ERR_clear_error();
  if (code == 0) {
    return "no reason given";
  }
  const char* reason = ERR_reason_error_string(code);
  if (reason != nullptr) {
    return reason;
  }
  std::array<char, 256> text{};
  ERR_error_string_n(code, text.data(), text.size());
  return text.data();
}

}  // namespace millrace::base::openssl
