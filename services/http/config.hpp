// Reads and checks http.textproto (schema and defaults: idl/http.proto).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/sdk/announcement.hpp"

namespace millrace::services::http {

/// The contents of the files of an endpoint; empty without a file.
struct Secrets {
  /// PEM.
  std::string ca{};
  std::string certificate{};
  std::string key{};
  std::string bearer_token{};
  /// The bytes behind `whsec_`.
  std::string signing_secret{};
  bool operator==(const Secrets&) const = default;
};

/// The files of Secrets, in the same order; empty = none.
struct SecretFiles {
  std::filesystem::path ca{};
  std::filesystem::path certificate{};
  std::filesystem::path key{};
  std::filesystem::path bearer_token{};
  std::filesystem::path signing_secret{};
  bool operator==(const SecretFiles&) const = default;
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
  SecretFiles files{};
  Secrets secrets{};
  bool operator==(const Endpoint&) const = default;
};

/// A change of a file applies after this time without another.
inline constexpr std::chrono::milliseconds settle{500};

/// The error has one line per mistake, with file, line and column. The endpoints have no secrets
/// yet.
tl::expected<std::vector<Endpoint>, std::string> load(const std::filesystem::path& file);

/// The endpoints with their secrets. A key, token or signing secret that other users can read is an
/// error.
tl::expected<std::vector<Endpoint>, std::string> with_secrets(std::vector<Endpoint> endpoints);

/// The files that the endpoints are read from: `config` and those of the secrets.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& config,
                                            const std::vector<Endpoint>& endpoints);

}  // namespace millrace::services::http
