#include "base/configuration/mistakes.hpp"

#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::base::configuration {

ConfigPath operator/(ConfigPath path, ConfigStep step) {
  path.push_back(std::move(step));
  return path;
}

ConfigPath operator/(ConfigPath path, std::string field) {
  return std::move(path) / ConfigStep{std::move(field)};
}

bool Mistakes::expect(bool holds, const ConfigPath& path, std::string_view what) {
  if (!holds) {
    std::string field;
    std::string key;
    for (const ConfigStep& step : path) {
      field += (field.empty() ? "" : ".") + step.field;
      key += fmt::format("{}[{}]", step.field, step.index);
    }
    if (wrong_fields_.insert(key).second) {
      lines_.emplace(places_.position(config_, path),
                     fmt::format("{}: {}{}{}", places_.at(config_, path), field,
                                 field.empty() ? "" : ": ", text::safe(what)));
    }
  }
  return holds;
}

std::string Mistakes::text() const {
  std::string text;
  for (const auto& [place, line] : lines_) {
    text += (text.empty() ? "" : "\n") + line;
  }
  return text;
}

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
