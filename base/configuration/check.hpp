// Checks a configuration against the options of its schema (idl/check.proto), and converts it.
//
//   auto config = load<config::Mail>("mail.textproto", [](const auto& from, Mistakes& mistakes) {
//     mistakes.expect(from.retry().longest_ms() >= from.retry().first_ms(), …);
//     return Config{…};
//   });
#pragma once

#include <filesystem>
#include <string>
#include <type_traits>

#include <google/protobuf/message.h>
#include <tl/expected.hpp>

#include "base/configuration/config_file.hpp"
#include "base/configuration/mistakes.hpp"

namespace millrace::base::configuration {

/// Records each field that is not as its options require.
void check(const google::protobuf::Message& config, Mistakes& mistakes);

/// What `convert(config, mistakes)` returns for the configuration in `text`; it records mistakes
/// that the options cannot express, and also gets a configuration with mistakes. The error has one
/// line for each mistake. `name` is the file's name in it.
template <typename Config, typename Convert>
auto load_text(const std::string& text, const std::string& name, Convert convert)
    -> tl::expected<std::invoke_result_t<Convert, const Config&, Mistakes&>, std::string> {
  Config config;
  ConfigPlaces places;
  if (const auto parsed = parse_config(text, name, config, &places); !parsed) {
    return tl::unexpected(parsed.error());
  }
  Mistakes mistakes(config, places);
  check(config, mistakes);
  auto converted = convert(static_cast<const Config&>(config), mistakes);
  if (!mistakes.none()) {
    return tl::unexpected(mistakes.text());
  }
  return converted;
}

/// The same for a file.
template <typename Config, typename Convert>
auto load(const std::filesystem::path& file, Convert convert) {
  return read_text(file).and_then(
      [&](const std::string& text) { return load_text<Config>(text, file.string(), convert); });
}

}  // namespace millrace::base::configuration
