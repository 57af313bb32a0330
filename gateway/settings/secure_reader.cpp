#include "gateway/settings/secure_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/openssl/certificate.hpp"
#include "cnc/ads/tls.hpp"

namespace millrace::gateway::settings {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::Mistakes;

/// Where systemd hands a unit what its LoadCredential= names: systemd.exec(5).
constexpr std::string_view credentials_variable = "$CREDENTIALS_DIRECTORY";

enum class Secrecy : std::uint8_t { open, secret };

class Files {
 public:
  Files(fs::path folder, Mistakes& mistakes) : folder_(std::move(folder)), mistakes_(mistakes) {}

  /// Empty, and noted as a mistake, if it cannot be read or is too open for a secret.
  std::string read(const std::string& named, const ConfigPath& path, Secrecy secrecy) {
    if (!mistakes_.expect(!named.empty(), path, "is missing; expected the name of a file")) {
      return {};
    }
    const fs::path file = place_of(named, path);
    if (file.empty() || !is_guarded(file, path, secrecy)) {
      return {};
    }
    std::ifstream in(file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    mistakes_.expect(in.is_open() && !in.bad(), path,
                     fmt::format("cannot read {}: {}; expected a file that the user of this "
                                 "program may read",
                                 file.string(), std::strerror(errno)));
    return text;
  }

 private:
  fs::path place_of(const std::string& named, const ConfigPath& path) {
    if (!named.starts_with(credentials_variable)) {
      return folder_ / named;
    }
    const char* const folder = std::getenv(credentials_variable.substr(1).data());
    const std::string below = named.substr(credentials_variable.size());
    const bool there = folder != nullptr && *folder != '\0' && below.starts_with('/');
    mistakes_.expect(there, path,
                     fmt::format("\"{}\"; expected {}/NAME, in a unit of systemd with "
                                 "LoadCredential=NAME:FILE",
                                 named, credentials_variable));
    return there ? fs::path(folder + below) : fs::path();
  }

  /// The rules for keys and certificates of the fabric (fabric/trust) hold for these, too.
  bool is_guarded(const fs::path& file, const ConfigPath& path, Secrecy secrecy) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) {
      return true;  // reading it says why
    }
    const bool secret = secrecy == Secrecy::secret;
    const mode_t writers = secret ? S_IWGRP | S_IWOTH : S_IWOTH;
    return mistakes_.expect(S_ISREG(status.st_mode), path,
                            fmt::format("{} is no regular file", file.string())) &&
           mistakes_.expect(
               !secret || (status.st_mode & S_IROTH) == 0, path,
               fmt::format("{} is a secret, and everybody on this host can read it: "
                           "`chmod o= {}`, and make it anew if others may have seen it",
                           file.string(), file.string())) &&
           mistakes_.expect((status.st_mode & writers) == 0, path,
                            fmt::format("others than its owner can write {}: `chmod go-w {}`, and "
                                        "make it anew if they may have changed it",
                                        file.string(), file.string()));
  }

  fs::path folder_;
  Mistakes& mistakes_;
};

cnc::ads::Psk psk(const config::SecurePsk& from, Files& files, const ConfigPath& path,
                  Mistakes& mistakes) {
  // What OpenSSL allows; capitals of other characters would be ours alone.
  constexpr std::size_t longest = 127;
  const bool plain =
      std::ranges::all_of(from.identity(), [](unsigned char c) { return c > ' ' && c < 0x7F; });
  mistakes.expect(!from.identity().empty() && from.identity().size() <= longest && plain,
                  path / "identity",
                  fmt::format("\"{}\"; expected 1 to {} letters, digits and signs of ASCII",
                              from.identity(), longest));
  std::string password = files.read(from.password_file(), path / "password_file", Secrecy::secret);
  password.resize(std::min(password.find_first_of("\r\n"), password.size()));
  mistakes.expect(
      !password.empty() || !mistakes.none(), path / "password_file",
      fmt::format("{} has an empty first line; expected the password in it", from.password_file()));
  return {from.identity(), password};
}

cnc::ads::SelfSigned self_signed(const config::SecureSelfSigned& from, Files& files,
                                 const ConfigPath& path, Mistakes& mistakes) {
  const auto fingerprint = base::openssl::parse_fingerprint(from.fingerprint());
  mistakes.expect(fingerprint.has_value(), path / "fingerprint",
                  fmt::format("\"{}\"; expected the SHA-256 fingerprint of the controller's "
                              "certificate, 32 bytes as in AB:CD:…; the controller shows it, and "
                              "so does `millrace controller add-route`",
                              from.fingerprint()));
  return {files.read(from.certificate(), path / "certificate", Secrecy::open),
          files.read(from.key(), path / "key", Secrecy::secret), fingerprint.value_or("")};
}

cnc::ads::SharedCa shared_ca(const config::SecureSharedCa& from, const std::string& host,
                             Files& files, const ConfigPath& path) {
  return {files.read(from.ca(), path / "ca", Secrecy::open),
          files.read(from.certificate(), path / "certificate", Secrecy::open),
          files.read(from.key(), path / "key", Secrecy::secret),
          from.common_name().empty() ? host : from.common_name()};
}

}  // namespace

std::optional<cnc::ads::Security> read_security(const config::Machine& machine,
                                                const fs::path& folder, const ConfigPath& path,
                                                Mistakes& mistakes) {
  if (!machine.has_secure()) {
    return std::nullopt;
  }
  const config::Secure& from = machine.secure();
  const ConfigPath here = path / "secure";
  const std::size_t modes = static_cast<std::size_t>(from.has_psk()) +
                            static_cast<std::size_t>(from.has_self_signed()) +
                            static_cast<std::size_t>(from.has_shared_ca());
  if (!mistakes.expect(
          modes == 1, here,
          fmt::format("has {} of psk, self_signed and shared_ca; expected one of them", modes))) {
    return std::nullopt;
  }
  const bool right_so_far = mistakes.none();
  Files files(folder, mistakes);
  cnc::ads::Security security;
  if (from.has_psk()) {
    security = psk(from.psk(), files, here / "psk", mistakes);
  } else if (from.has_self_signed()) {
    security = self_signed(from.self_signed(), files, here / "self_signed", mistakes);
  } else {
    security = shared_ca(from.shared_ca(), machine.host(), files, here / "shared_ca");
  }
  if (right_so_far && mistakes.none()) {
    const auto usable = cnc::ads::TlsContext::client(security);
    mistakes.expect(usable.has_value(), here, usable ? "" : usable.error());
  }
  return security;
}

}  // namespace millrace::gateway::settings
