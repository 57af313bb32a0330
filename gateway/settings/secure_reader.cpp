#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/configuration/mistakes.hpp"
#include "base/openssl/certificate.hpp"
#include "base/posix/guarded_file.hpp"
#include "cnc/ads/tls.hpp"
#include "gateway/settings/readers.hpp"

namespace millrace::gateway::settings {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::Mistakes;
using base::posix::Secrecy;

class Files {
 public:
  Files(fs::path folder, Mistakes& mistakes) : folder_(std::move(folder)), mistakes_(mistakes) {}

  /// Empty, and noted as a mistake, if it cannot be read or is too open for a secret.
  std::string read(const std::string& named, const ConfigPath& path, Secrecy secrecy) {
    const fs::path file = mistakes_.take(base::configuration::place_of(named, folder_), path);
    auto text = base::posix::read_guarded(file, secrecy);
    mistakes_.expect(text.has_value(), path, text ? "" : describe(file, text.error()));
    return text.value_or("");
  }

 private:
  static std::string describe(const fs::path& file, const base::posix::FileFault& fault) {
    return fmt::format("{} {}{}{}", file.string(), fault.what, fault.advice.empty() ? "" : ": ",
                       fault.advice);
  }

  fs::path folder_;
  Mistakes& mistakes_;
};

cnc::ads::Psk psk(const config::SecurePsk& from, Files& files, const ConfigPath& path,
                  Mistakes& mistakes) {
  std::string password = files.read(from.password_file(), path / "password_file", Secrecy::secret);
  password.resize(std::min(password.find_first_of("\r\n"), password.size()));
  mistakes.expect(
      !password.empty(), path / "password_file",
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
  Files files(folder, mistakes);
  cnc::ads::Security security;
  if (from.has_psk()) {
    security = psk(from.psk(), files, here / "psk", mistakes);
  } else if (from.has_self_signed()) {
    security = self_signed(from.self_signed(), files, here / "self_signed", mistakes);
  } else {
    security = shared_ca(from.shared_ca(), machine.host(), files, here / "shared_ca");
  }
  if (mistakes.none()) {
    const auto usable = cnc::ads::TlsContext::client(security);
    mistakes.expect(usable.has_value(), here, usable ? "" : usable.error());
  }
  return security;
}

}  // namespace millrace::gateway::settings
