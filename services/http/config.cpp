#include "services/http/config.hpp"

#include <set>

#include <fmt/format.h>
#include <openssl/evp.h>

#include "base/configuration/check.hpp"
#include "base/posix/guarded_file.hpp"
#include "idl/http.pb.h"
#include "services/http/url.hpp"

namespace millrace::services::http {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;
using base::posix::Secrecy;

fs::path place(const std::string& named, const fs::path& folder, const ConfigPath& path,
               Mistakes& mistakes) {
  return named.empty() ? fs::path()
                       : mistakes.take(base::configuration::place_of(named, folder), path);
}

/// All of a service but its URL.
Endpoint endpoint_from(const config::Http::Service& from, const fs::path& folder,
                       const ConfigPath& path, Mistakes& mistakes) {
  Endpoint endpoint{.announcement =
                        sdk::announced(from, config::Http::AT_LEAST_ONCE, path, mistakes)};
  endpoint.health_period = std::chrono::milliseconds(from.health_ms());
  endpoint.time_limit = std::chrono::milliseconds(from.time_limit_ms());
  endpoint.proxy = from.proxy();
  const auto file = [&](const std::string& named, const char* field) {
    return SecretFile{.path = place(named, folder, path / field, mistakes)};
  };
  endpoint.ca = file(from.ca_file(), "ca_file");
  endpoint.certificate = file(from.certificate_file(), "certificate_file");
  endpoint.key = file(from.key_file(), "key_file");
  endpoint.bearer_token = file(from.bearer_token_file(), "bearer_token_file");
  endpoint.signing_secret = file(from.signing_secret_file(), "signing_secret_file");
  mistakes.expect(from.certificate_file().empty() == from.key_file().empty(),
                  path / "certificate_file", "needs key_file, and key_file needs it");
  if (!from.proxy().empty()) {
    mistakes.take(parse_url(from.proxy()), path / "proxy");
  }
  mistakes.expect(from.health().empty() || from.health().starts_with('/'), path / "health",
                  "must be a path that begins with '/'");
  return endpoint;
}

void check_url(const config::Http::Service& from, const Url& url, const ConfigPath& path,
               Mistakes& mistakes) {
  const bool tls = url.scheme == "https";
  mistakes.expect(tls || (from.ca_file().empty() && from.certificate_file().empty()), path,
                  "must begin with https:// to use ca_file or certificate_file");
  mistakes.expect(tls || url.is_loopback() || from.bearer_token_file().empty(), path,
                  "must begin with https:// to use bearer_token_file, or the token could be read "
                  "on the way");
}

std::vector<Endpoint> endpoints_from(const config::Http& from, const fs::path& folder,
                                     Mistakes& mistakes) {
  std::vector<Endpoint> endpoints;
  std::set<std::string> uuids;
  for (int i = 0; i < from.service_size(); ++i) {
    const config::Http::Service& service = from.service(i);
    const ConfigPath path{{"service", i}};
    const Endpoint common = endpoint_from(service, folder, path, mistakes);
    mistakes.expect(uuids.insert(common.announcement.uuid).second, path / "uuid",
                    fmt::format("\"{}\" occurs twice", service.uuid()));
    std::set<std::string> urls;
    for (int u = 0; u < service.url_size(); ++u) {
      const ConfigPath place = path / ConfigStep{"url", u};
      const Url url = mistakes.take(parse_url(service.url(u)), place);
      check_url(service, url, place, mistakes);
      mistakes.expect(urls.insert(service.url(u)).second, place,
                      fmt::format("\"{}\" occurs twice", service.url(u)));
      Endpoint& endpoint = endpoints.emplace_back(common);
      endpoint.url = service.url(u);
      endpoint.health_url = service.health().empty() ? "" : url.origin() + service.health();
      if (service.name().empty()) {
        endpoint.announcement.name = url.host_and_port();
      }
      if (service.description().empty()) {
        endpoint.announcement.description = endpoint.url;
      }
    }
  }
  return endpoints;
}

using Contents = tl::expected<std::string, std::string>;
using Wrong = tl::unexpected<std::string>;

Contents contents(const fs::path& file, Secrecy secrecy) {
  return base::posix::read_guarded(file, secrecy)
      .map_error([](const base::posix::FileFault& fault) {
        return fault.what + (fault.advice.empty() ? "" : ": ") + fault.advice;
      });
}

Contents open_file(const fs::path& file) {
  return contents(file, Secrecy::open);
}

Contents secret_file(const fs::path& file) {
  return contents(file, Secrecy::secret);
}

/// An error if it cannot be a header.
Contents first_line(const fs::path& file) {
  return secret_file(file).and_then([](const std::string& text) -> Contents {
    std::string line = text.substr(0, text.find_first_of("\r\n"));
    if (line.empty() || !std::ranges::all_of(line, [](char c) { return c > ' ' && c <= '~'; })) {
      return Wrong("its first line is empty or has blanks or unprintable bytes");
    }
    return line;
  });
}

Contents signing_secret(const fs::path& file) {
  return first_line(file).and_then([](const std::string& line) -> Contents {
    constexpr std::string_view prefix = "whsec_";
    constexpr std::size_t least = 24;
    constexpr std::size_t most = 64;
    const std::string text = line.starts_with(prefix) ? line.substr(prefix.size()) : "";
    std::string bytes(text.size(), '\0');
    // Without its padding, which OpenSSL counts.
    const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                     reinterpret_cast<const unsigned char*>(text.data()),
                                     static_cast<int>(text.size())) -
                     static_cast<int>(std::ranges::count(text, '='));
    if (size < static_cast<int>(least) || size > static_cast<int>(most)) {
      return Wrong(
          "expected whsec_ and Base64 of 24 to 64 bytes, as printed by: "
          "echo whsec_$(openssl rand -base64 32)");
    }
    bytes.resize(static_cast<std::size_t>(size));
    return bytes;
  });
}

/// Each of its files, and what reads it.
std::vector<std::pair<SecretFile*, Contents (*)(const fs::path&)>> files_of(Endpoint& endpoint) {
  return {{&endpoint.ca, &open_file},
          {&endpoint.certificate, &open_file},
          {&endpoint.key, &secret_file},
          {&endpoint.bearer_token, &first_line},
          {&endpoint.signing_secret, &signing_secret}};
}

}  // namespace

tl::expected<std::vector<Endpoint>, std::string> load(const fs::path& file) {
  return base::configuration::load<config::Http>(
      file, [&](const config::Http& from, Mistakes& mistakes) {
        return endpoints_from(from, fs::absolute(file).parent_path(), mistakes);
      });
}

tl::expected<std::vector<Endpoint>, std::string> with_secrets(std::vector<Endpoint> endpoints) {
  for (Endpoint& endpoint : endpoints) {
    for (const auto& [file, read] : files_of(endpoint)) {
      auto contents = file->path.empty() ? Contents() : read(file->path);
      if (!contents) {
        return tl::unexpected(file->path.string() + ": " + contents.error());
      }
      file->contents = *std::move(contents);
    }
  }
  return endpoints;
}

std::vector<fs::path> files_of(const fs::path& config, std::vector<Endpoint> endpoints) {
  std::set<fs::path> files{config};
  for (Endpoint& endpoint : endpoints) {
    for (const auto& [file, read] : files_of(endpoint)) {
      files.insert(file->path);
    }
  }
  files.erase(fs::path());
  return {files.begin(), files.end()};
}

}  // namespace millrace::services::http
