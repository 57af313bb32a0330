// Where a file or folder is that a configuration names.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace millrace::base::configuration {

/// A relative path starts at `folder`, that of the configuration; one that begins with
/// $CREDENTIALS_DIRECTORY where systemd puts what a unit's LoadCredential= names
/// (systemd.exec(5)). The error says that there is no such place.
tl::expected<std::filesystem::path, std::string> place_of(const std::string& named,
                                                          const std::filesystem::path& folder);

}  // namespace millrace::base::configuration
