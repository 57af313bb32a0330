#include "base/program/version.hpp"

#include <string_view>

#include <fmt/format.h>

namespace millrace::base::program {

const char* version() {
  return MILLRACE_VERSION;
}

[[gnu::weak]] const char* commit() {
  return "";
}

std::string version_and_commit() {
  const std::string_view from = commit();
  return from.empty() ? std::string(version()) : fmt::format("{}, commit {}", version(), from);
}

}  // namespace millrace::base::program
