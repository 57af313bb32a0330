// Resolves the path of a file or folder in a configuration.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace millrace::base::configuration {

/// A relative path starts at `folder`, the folder of the configuration. A path that begins with
/// $CREDENTIALS_DIRECTORY is in the folder where systemd stores the credentials of a unit's
/// LoadCredential= (systemd.exec(5)); an error if there is none.
tl::expected<std::filesystem::path, std::string> place_of(const std::string& named,
                                                          const std::filesystem::path& folder);

}  // namespace millrace::base::configuration
