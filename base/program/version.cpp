#include "base/program/version.hpp"

#include <string_view>

#include <fmt/format.h>

namespace millrace::base::program {

[[gnu::weak]] const char* commit() {
  return "";
}

std::string version_and_commit() {
  const std::string_view from = commit();
  return from.empty() ? MILLRACE_VERSION : fmt::format("{}, commit {}", MILLRACE_VERSION, from);
}

}  // namespace millrace::base::program
