#include "services/archiver/config.hpp"

#include "base/configuration/check.hpp"
#include "fabric/messages.hpp"
#include "idl/archiver.pb.h"

namespace millrace::services::archiver {

namespace {

constexpr unsigned mib_bits = 20;

Config config_from(const config::Archiver& from, const std::filesystem::path& base) {
  Config config;
  config.folder = (base / from.folder()).lexically_normal();
  config.policy = {.rotate_bytes = std::uintmax_t{from.rotate_mib()} << mib_bits,
                   .rotate_age = std::chrono::hours(from.rotate_hours()),
                   .keep_age = std::chrono::hours(24) * from.keep_days(),
                   .keep_bytes = std::uintmax_t{from.keep_mib()} << mib_bits};
  config.record_events = from.record_events();
  config.record_channels = from.record_channels();
  config.record_data = from.record_data();
  config.record_programs = from.record_programs();
  for (const std::string& uuid : from.without_text()) {
    config.without_text.insert(fabric::canonical_uuid(uuid));
  }
  return config;
}

}  // namespace

tl::expected<Config, std::string> load(const std::filesystem::path& file) {
  return base::configuration::load<config::Archiver>(file, [&](const auto& from, auto&) {
    return config_from(from, std::filesystem::absolute(file).parent_path());
  });
}

Config default_config(const std::filesystem::path& folder) {
  return config_from(config::Archiver(), std::filesystem::absolute(folder));
}

}  // namespace millrace::services::archiver
