#include "services/sdk/isg_settings.hpp"

#include <sstream>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/profile/profile.hpp"
#include "fabric/words.hpp"

namespace millrace::services::sdk {

namespace {

using Read = tl::expected<void, std::string>;

Read wrong(std::string_view variable, std::string_view value, std::string_view expected) {
  return tl::unexpected(fmt::format("{}={}: expected {}", variable, value, expected));
}

Read read_profile(std::string_view value, IsgSettings& settings) {
  if (value.empty()) {
    return {};
  }
  auto profile = fabric::profile::read_profile(std::string(value));
  if (!profile) {
    return tl::unexpected(std::move(profile.error()));
  }
  settings.options.domain = profile->domain;
  settings.options.fabric = std::move(profile->fabric);
  settings.options.lease = profile->lease;
  settings.options.configuration = std::move(profile->configuration);
  settings.options.trust = std::move(profile->trust);
  return {};
}

Read read_domain(std::string_view value, IsgSettings& settings) {
  const auto domain = base::text::parse_number<std::uint32_t>(value);
  if (!domain || *domain > fabric::profile::last_domain) {
    return wrong("MILLRACE_DOMAIN", value,
                 fmt::format("a number from 0 to {}", fabric::profile::last_domain));
  }
  settings.options.domain = *domain;
  return {};
}

Read read_fabric(std::string_view value, IsgSettings& settings) {
  settings.options.fabric = value;
  return {};
}

Read read_channels(std::string_view value, IsgSettings& settings) {
  std::istringstream words{std::string(value)};
  for (std::string word; words >> word;) {
    const auto scope = fabric::parse_channel_scope(word);
    if (!scope) {
      return wrong("MILLRACE_CHANNELS", value, "MACHINE/N, separated by blanks");
    }
    settings.options.channels.push_back(*scope);
  }
  return {};
}

Read read_delivery(std::string_view value, IsgSettings& settings) {
  const auto delivery = fabric::parse_delivery(value);
  if (!delivery) {
    return wrong("MILLRACE_DELIVERY", value,
                 fmt::format("{} or {}", name_of(fabric::Delivery::at_least_once),
                             name_of(fabric::Delivery::at_most_once)));
  }
  settings.options.delivery = *delivery;
  return {};
}

Read read_completion_signal(std::string_view value, IsgSettings& settings) {
  const auto completion_signal = fabric::parse_completion_signal(value);
  if (!completion_signal) {
    return wrong("MILLRACE_COMPLETION_SIGNAL", value,
                 fmt::format("{} or {}", name_of(fabric::CompletionSignal::response_state),
                             name_of(fabric::CompletionSignal::response)));
  }
  settings.options.completion_signal = *completion_signal;
  return {};
}

Read read_log_level(std::string_view value, IsgSettings& settings) {
  settings.log_level = spdlog::level::from_str(std::string(value));
  // spdlog takes an unknown level for "off".
  if (settings.log_level == spdlog::level::off) {
    return wrong("MILLRACE_LOG_LEVEL", value, "error, warn, info, debug or trace");
  }
  return {};
}

}  // namespace

tl::expected<IsgSettings, std::string> read_isg_settings(const Environment& environment,
                                                         const std::filesystem::path& of_host) {
  struct Variable {
    const char* name;
    Read (*read)(std::string_view, IsgSettings&);
  };
  constexpr Variable variables[] = {
      {"MILLRACE_DOMAIN", read_domain},
      {"MILLRACE_FABRIC", read_fabric},
      {"MILLRACE_CHANNELS", read_channels},
      {"MILLRACE_DELIVERY", read_delivery},
      {"MILLRACE_COMPLETION_SIGNAL", read_completion_signal},
      {"MILLRACE_LOG_LEVEL", read_log_level},
  };
  IsgSettings settings;
  // First: a single setting wins over the file.
  const std::string file =
      fabric::profile::profile_to_read(environment("MILLRACE_FABRIC_CONFIG"), of_host);
  if (auto read = read_profile(file, settings); !read) {
    return tl::unexpected(std::move(read.error()));
  }
  for (const Variable& variable : variables) {
    const char* value = environment(variable.name);
    if (value == nullptr) {
      continue;
    }
    if (auto read = variable.read(value, settings); !read) {
      return tl::unexpected(std::move(read.error()));
    }
  }
  return settings;
}

}  // namespace millrace::services::sdk
