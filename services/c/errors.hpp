// Errors of the C interface: a code, and a text for the calling thread.
//
//   millrace_code millrace_drain(millrace_service* service) {
//     return guarded([&] { state_of(service).drain(); });
//   }
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

#include "services/c/millrace.h"

namespace millrace::services::c {

class Error : public std::runtime_error {
 public:
  Error(millrace_code code, const std::string& text) : std::runtime_error(text), code_(code) {}
  [[nodiscard]] millrace_code code() const { return code_; }

 private:
  millrace_code code_;
};

/// Sets what millrace_error() returns in this thread.
void remember_error(std::string_view text) noexcept;
/// The code of the exception that is being handled. Remembers its text.
millrace_code code_of_exception() noexcept;

/// The result of `work`, or MILLRACE_OK if it has none; no exception leaves it.
template <typename Work>
millrace_code guarded(const Work& work) noexcept {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      work();
      return MILLRACE_OK;
    } else {
      return work();
    }
  } catch (...) {
    return code_of_exception();
  }
}

/// Throws Error if `handle` is NULL.
template <typename Handle>
Handle& checked(Handle* handle, const char* what) {
  if (handle == nullptr) {
    throw Error(MILLRACE_INVALID, fmt::format("{} is NULL", what));
  }
  return *handle;
}

/// The options of a program as this library knows them. Members that the program does not know
/// are 0. Throws Error if the program sets a member that this library does not know.
template <typename Options>
Options read_options(const Options& given, const char* what) {
  Options options{};
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&given);
  if (given.size < sizeof given.size) {
    throw Error(MILLRACE_INVALID, fmt::format("{}: its member 'size' is {}; expected sizeof({})",
                                              what, given.size, what));
  }
  for (std::size_t i = sizeof options; i < given.size; ++i) {
    if (bytes[i] != 0) {
      throw Error(MILLRACE_INVALID,
                  fmt::format("{}: the member at byte {} is set, but this version of the library "
                              "does not have it",
                              what, i));
    }
  }
  std::memcpy(&options, bytes, given.size < sizeof options ? given.size : sizeof options);
  return options;
}

/// Throws Error for NULL with a length.
inline std::string_view text_of(const char* text, std::size_t length, const char* what) {
  if (text == nullptr && length != 0 && length != MILLRACE_TERMINATED) {
    throw Error(MILLRACE_INVALID, fmt::format("{} is NULL, its length {}", what, length));
  }
  if (text == nullptr) {
    return {};
  }
  return length == MILLRACE_TERMINATED ? std::string_view(text) : std::string_view(text, length);
}

inline std::string string_or(const char* text, std::string other = {}) {
  return text != nullptr ? std::string(text) : std::move(other);
}

}  // namespace millrace::services::c
