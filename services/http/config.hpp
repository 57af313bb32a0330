// Reads and checks http.textproto (schema and defaults: idl/http.proto).
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/sdk/announcement.hpp"

namespace millrace::services::http {

/// Both are empty without a file.
struct SecretFile {
  std::filesystem::path path{};
  std::string contents{};
  bool operator==(const SecretFile&) const = default;
};

/// One URL of a service: an instance on the fabric.
struct Endpoint {
  sdk::Announcement announcement{.delivery = fabric::Delivery::at_most_once};
  std::string url{};
  /// URL of the health check; empty if a connection is enough.
  std::string health_url{};
  std::chrono::milliseconds health_period{5000};
  std::chrono::milliseconds time_limit{30000};
  /// Empty = none.
  std::string proxy{};
  /// PEM.
  SecretFile ca{};
  SecretFile certificate{};
  SecretFile key{};
  /// Its first line.
  SecretFile bearer_token{};
  /// The bytes behind `whsec_`.
  SecretFile signing_secret{};
  bool operator==(const Endpoint&) const = default;
};

/// A change of a file applies after this time without another.
inline constexpr std::chrono::milliseconds settle{500};

/// The error has one line per mistake, with file, line and column. The files of the
/// endpoints are not read yet.
tl::expected<std::vector<Endpoint>, std::string> load(const std::filesystem::path& file);

/// The endpoints with their secrets. A key, token or signing secret that other users can read is an
/// error.
tl::expected<std::vector<Endpoint>, std::string> with_secrets(std::vector<Endpoint> endpoints);

/// The files that the endpoints are read from: `config` and those of the secrets.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& config,
                                            std::vector<Endpoint> endpoints);

}  // namespace millrace::services::http
