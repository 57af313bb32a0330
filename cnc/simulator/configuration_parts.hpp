// Parts of a virtual CNC's configuration: Secure ADS, discovery and system data.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/configuration/mistakes.hpp"
#include "cnc/simulator/settings.hpp"
#include "cnc/simulator/system_data.hpp"
#include "idl/cnc.pb.h"

namespace millrace::cnc::simulator {

// Secure ADS.

/// Nullopt if the file has no secure_ads. A relative path starts at `base`.
std::optional<SecureAdsSettings> read_secure_ads(const config::Cnc& config,
                                                 const std::filesystem::path& base,
                                                 base::configuration::Mistakes& mistakes);
/// Nullopt if the file has no discovery.
std::optional<DiscoverySettings> read_discovery(const config::Cnc& config,
                                                base::configuration::Mistakes& mistakes);

/// Of a variable or of system data.
template <typename From>
ElementType element_of(const From& from) {
  const Type type{static_cast<std::uint32_t>(from.type())};
  return type == Type::string ? ElementType::text(from.characters()) : ElementType::number(type);
}

// System data.

/// Records every mistake with its place.
std::vector<DataDeclaration> read_system_data(const config::Cnc& config,
                                              base::configuration::Mistakes& mistakes);

}  // namespace millrace::cnc::simulator
