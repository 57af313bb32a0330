// The environment variables of a service that is written against services/sdk/isg_service.h.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <spdlog/common.h>
#include <tl/expected.hpp>

#include "fabric/profile/profile.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

struct IsgSettings {
  /// Everything but UUID, name and description.
  ServiceOptions options{};
  spdlog::level::level_enum log_level = spdlog::level::info;
};

/// The value of an environment variable, or null.
using Environment = std::function<const char*(const char*)>;

/// If the environment names no profile, `of_host` is read if it exists. The error names the
/// variable and what was expected.
tl::expected<IsgSettings, std::string> read_isg_settings(
    const Environment& environment,
    const std::filesystem::path& of_host = fabric::profile::host_profile);

}  // namespace millrace::services::sdk
