#include "tools/trust/certificate_authorities.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>

#include <fmt/format.h>
#include <openssl/sha.h>
#include <sys/stat.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/signed_text.hpp"
#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"
#include "fabric/trust/folder.hpp"
#include "fabric/trust/permissions.hpp"

namespace millrace::tools::trust {

namespace {

// A name for a participant that must not begin a handshake. Of two participants with DDS Security
// the one with the lower GUID begins, and its GUID begins with a hash of the name in its
// certificate (DDS Security 1.1, 9.3.3). Fast DDS 2.9 begins with a key agreement that Cyclone
// encodes differently (Fast-DDS issue 3802, Cyclone DDS issue 1547), but accepts Cyclone's if
// Cyclone begins. So a participant with Fast DDS gets a name whose hash is higher than those of the
// others. Pure.
//
//   subject.number = late_number(subject);

constexpr std::uint32_t numbers = 100'000'000;

bool is_high(const std::string& encoded) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what SHA256() takes.
  SHA256(reinterpret_cast<const unsigned char*>(encoded.data()), encoded.size(), hash.data());
  constexpr unsigned char ones = 0xff;
  constexpr unsigned char high_half = 0xf0;
  return hash[0] == ones && hash[1] == ones && (hash[2] & high_half) == high_half;
}

/// Eight digits that give the subject a hash whose first 20 bits are ones: of a million other names
/// one is higher. Takes half a second.
std::string late_number(base::openssl::Subject subject) {
  subject.number = fmt::format("{:08}", 0);
  std::string encoded = base::openssl::encoded_name(subject);
  // It comes last, so what is encoded ends with its digits.
  const std::size_t at = encoded.size() - subject.number.size();
  assert(encoded.substr(at) == subject.number);
  for (std::uint32_t number = 0; number < numbers; ++number) {
    encoded.replace(at, subject.number.size(), fmt::format("{:08}", number));
    if (is_high(encoded)) {
      break;
    }
  }
  return encoded.substr(at);
}

namespace fs = std::filesystem;
namespace openssl = base::openssl;
namespace files = fabric::trust::files;
using openssl::Certificate;
using openssl::Key;

/// File names in the folder of the CAs.
constexpr std::string_view identity_name = "identity";
constexpr std::string_view permissions_name = "permissions";

fs::path key_file(const fs::path& folder, std::string_view name) {
  return folder / fmt::format("{}.key", name);
}

fs::path certificate_file(const fs::path& folder, std::string_view name) {
  return folder / fmt::format("{}.pem", name);
}

tl::expected<std::string, std::string> content_of(const fs::path& file) {
  return base::posix::read_guarded(file, base::posix::Secrecy::open)
      .map_error([&](const base::posix::FileFault& fault) {
        return fmt::format("{}: {}{}{}", file.string(), fault.what,
                           fault.advice.empty() ? "" : "; ", fault.advice);
      });
}

/// Only its owner may read an unencrypted key.
tl::expected<void, std::string> check_mode(const fs::path& file, std::string_view passphrase) {
  struct stat status {};
  if (passphrase.empty() && ::stat(file.c_str(), &status) == 0 &&
      (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return tl::unexpected(fmt::format(
        "{0}: is the private key of a CA, and other users of this host can read it; run `chmod go= "
        "{0}`, and create a new PKI if others may have read it: it can issue any certificate",
        file.string()));
  }
  return {};
}

/// The certificate that signs documents. Cyclone 0.10.2 builds a chain from the certificate in a
/// document to its configured CA; if that certificate is the CA's own root, it must be the
/// identical file, so that documents from before a renewal would not be valid after it, nor new
/// ones before it. A certificate that the CA has issued for its own key avoids this. Others (Fast
/// DDS, later Cyclones) find the CA by issuer and serial number, hence the CA's serial number,
/// which a renewal also keeps.
Certificate signing_certificate(const Certificate& authority, const Key& key) {
  return openssl::issue(key,
                        {.organisation = authority.organisation(),
                         .common_name = "permissions",
                         .from = authority.from(),
                         .until = authority.until(),
                         .serial = authority.serial()},
                        authority, key);
}

}  // namespace

CertificateAuthorities CertificateAuthorities::create(std::string_view plant, Time from,
                                                      Time until) {
  const auto authority = [&](std::string_view what) {
    Key key = Key::generate();
    Certificate certificate =
        openssl::self_signed(key, {.organisation = std::string(plant),
                                   .common_name = fmt::format("{} authority", what),
                                   .from = from,
                                   .until = until});
    return Authority{std::move(key), std::move(certificate)};
  };
  return {authority(identity_name), authority(permissions_name)};
}

tl::expected<CertificateAuthorities, std::string> CertificateAuthorities::read(
    const fs::path& folder, std::string_view passphrase) {
  const auto authority = [&](std::string_view name) -> tl::expected<Authority, std::string> {
    const fs::path of_key = key_file(folder, name);
    const auto in = [](const fs::path& file) {
      return [file](const std::string& what) { return fmt::format("{}: {}", file.string(), what); };
    };
    if (auto checked = check_mode(of_key, passphrase); !checked) {
      return tl::unexpected(checked.error());
    }
    auto key = content_of(of_key).and_then(
        [&](const std::string& pem) { return Key::read(pem, passphrase).map_error(in(of_key)); });
    if (!key) {
      return tl::unexpected(key.error());
    }
    const fs::path of_certificate = certificate_file(folder, name);
    auto certificate = content_of(of_certificate).and_then([&](const std::string& pem) {
      return Certificate::read(pem).map_error(in(of_certificate));
    });
    if (!certificate) {
      return tl::unexpected(certificate.error());
    }
    if (!certificate->belongs_to(*key)) {
      return tl::unexpected(fmt::format("{}: does not belong to {}", of_certificate.string(),
                                        of_key.filename().string()));
    }
    return Authority{std::move(*key), std::move(*certificate)};
  };
  auto identity = authority(identity_name);
  if (!identity) {
    return tl::unexpected(identity.error());
  }
  auto permissions = authority(permissions_name);
  if (!permissions) {
    return tl::unexpected(permissions.error());
  }
  return CertificateAuthorities(std::move(*identity), std::move(*permissions));
}

tl::expected<void, std::string> CertificateAuthorities::write(const fs::path& folder,
                                                              std::string_view passphrase) const {
  if (::mkdir(folder.c_str(), owner_folder) != 0) {
    return tl::unexpected(
        fmt::format("{}: cannot be created ({})", folder.string(), std::strerror(errno)));
  }
  const auto put = [&](const Authority& authority, std::string_view name) {
    return base::posix::write_durably(key_file(folder, name), authority.key.pem(passphrase),
                                      owner_only)
        .and_then([&] {
          return base::posix::write_durably(certificate_file(folder, name),
                                            authority.certificate.pem());
        });
  };
  return put(identity_, identity_name).and_then([&] {
    return put(permissions_, permissions_name);
  });
}

void CertificateAuthorities::renew(Time until) {
  for (Authority* authority : {&identity_, &permissions_}) {
    const Certificate& old = authority->certificate;
    authority->certificate =
        openssl::self_signed(authority->key, {.organisation = old.organisation(),
                                              .common_name = old.common_name(),
                                              .from = old.from(),
                                              .until = until,
                                              .serial = old.serial()});
  }
}

tl::expected<void, std::string> CertificateAuthorities::write_certificates(
    const fs::path& folder) const {
  const auto put = [&](const Authority& authority, std::string_view name) {
    return base::posix::write_durably(certificate_file(folder, name), authority.certificate.pem());
  };
  return put(identity_, identity_name).and_then([&] {
    return put(permissions_, permissions_name);
  });
}

tl::expected<Time, std::string> CertificateAuthorities::end_of(const fs::path& folder) {
  const auto end = [&](std::string_view name) {
    const fs::path file = certificate_file(folder, name);
    return content_of(file).and_then([&](const std::string& pem) {
      return Certificate::read(pem)
          .map([](const Certificate& certificate) { return certificate.until(); })
          .map_error(
              [&](const std::string& what) { return fmt::format("{}: {}", file.string(), what); });
    });
  };
  return end(identity_name).and_then([&](Time identity) {
    return end(permissions_name).map([&](Time permissions) {
      return std::min(identity, permissions);
    });
  });
}

CredentialFiles CertificateAuthorities::issue(const fabric::trust::Participant& participant,
                                              bool foreign, std::string_view fabric, Time from,
                                              Time until,
                                              const std::vector<openssl::Revoked>& revoked) const {
  using fabric::trust::Protection;
  const Key key = Key::generate();
  // The PKI's name is that of its CAs.
  openssl::Subject subject{.organisation = identity_.certificate.organisation(),
                           .common_name = participant.name,
                           .from = from,
                           .until = until};
  if (foreign) {
    subject.number = late_number(subject);
  }
  const Certificate certificate =
      openssl::issue(key, subject, identity_.certificate, identity_.key);
  const Certificate signer = signing_certificate(permissions_.certificate, permissions_.key);
  const auto sign = [&](const std::string& document) {
    return openssl::sign_text(document, signer, permissions_.key);
  };
  const auto governance = [&](Protection protection) {
    return CredentialFiles::File{std::string(fabric::trust::governance_file(protection)),
                                 sign(fabric::trust::governance_document(protection))};
  };
  CredentialFiles made{.files = {}, .serial = certificate.serial()};
  made.files.push_back({std::string(files::key), key.pem(), true});
  made.files.push_back({std::string(files::certificate), certificate.pem()});
  made.files.push_back({std::string(files::identity_authority), identity_.certificate.pem()});
  made.files.push_back({std::string(files::permissions_authority), permissions_.certificate.pem()});
  made.files.push_back({std::string(files::revoked), revocations(revoked, from)});
  made.files.push_back(
      {std::string(files::permissions),
       sign(fabric::trust::permissions_document(fabric::trust::grants_of(participant, fabric),
                                                certificate.subject(), from, until))});
  made.files.push_back(governance(Protection::sign));
  made.files.push_back(governance(Protection::encrypt));
  return made;
}

std::string CertificateAuthorities::revocations(const std::vector<openssl::Revoked>& revoked,
                                                Time now) const {
  return openssl::revocation_list(revoked, identity_.certificate, identity_.key, now, until());
}

}  // namespace millrace::tools::trust
