#include "services/archiver/config.hpp"

#include "base/configuration/config_file.hpp"
#include "fabric/messages.hpp"
#include "idl/archiver.pb.h"

namespace millrace::services::archiver {

namespace {

constexpr unsigned mib_bits = 20;

Config config_from(const config::Archiver& from, const std::filesystem::path& base) {
  Config config;
  config.folder = (std::filesystem::absolute(base) / from.folder()).lexically_normal();
  config.policy = {.rotate_bytes = std::uintmax_t{from.rotate_mib()} << mib_bits,
                   .rotate_age = std::chrono::hours(from.rotate_hours()),
                   .keep_age = std::chrono::hours(24) * from.keep_days(),
                   .keep_bytes = std::uintmax_t{from.keep_mib()} << mib_bits};
  config.record_events = from.record_events();
  config.record_channels = from.record_channels();
  for (const std::string& uuid : from.without_text()) {
    config.without_text.insert(fabric::canonical_uuid(uuid));
  }
  return config;
}

}  // namespace

tl::expected<Config, std::string> load(const std::filesystem::path& file) {
  return base::configuration::read_config<config::Archiver>(file).map(
      [&](const config::Archiver& from) { return config_from(from, file.parent_path()); });
}

Config default_config(const std::filesystem::path& folder) {
  return config_from(config::Archiver(), folder);
}

}  // namespace millrace::services::archiver
