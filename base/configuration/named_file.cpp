#include "base/configuration/named_file.hpp"

#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

namespace millrace::base::configuration {

namespace {

constexpr std::string_view credentials_variable = "$CREDENTIALS_DIRECTORY";

}  // namespace

tl::expected<std::filesystem::path, std::string> place_of(const std::string& named,
                                                          const std::filesystem::path& folder) {
  if (!named.starts_with(credentials_variable)) {
    return folder / named;
  }
  const std::string below = named.substr(credentials_variable.size());
  if (!below.empty() && below.front() != '/') {
    return tl::unexpected(
        fmt::format("\"{}\"; expected {} alone, or a '/' behind it", named, credentials_variable));
  }
  const char* const handed = std::getenv(credentials_variable.substr(1).data());
  if (handed == nullptr || *handed == '\0') {
    return tl::unexpected(
        fmt::format("{} is not set: systemd sets it for units with LoadCredential=NAME:FILE "
                    "(docs/how-to/secure-a-network.md has the drop-in for them); a program that is "
                    "started by hand "
                    "needs a configuration of its own that names a file or folder (--config, "
                    "--fabric-config)",
                    credentials_variable));
  }
  return std::filesystem::path(handed + below);
}

}  // namespace millrace::base::configuration
