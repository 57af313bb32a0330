#include "fabric/trust/folder.hpp"

#include <dds/dds.h>
#include <dlfcn.h>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/revocations.hpp"
#include "base/openssl/signed_text.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/text/quoted.hpp"
#include "fabric/trust/permissions.hpp"

namespace millrace::fabric::trust {

namespace {

namespace fs = std::filesystem;
namespace openssl = base::openssl;
namespace posix = base::posix;
using openssl::Certificate;
using openssl::Key;

template <typename T>
using Result = tl::expected<T, std::string>;

constexpr std::string_view ask_for_it =
    "run `millrace trust issue` to make all files of a participant, and copy its folder again";

constexpr std::string_view renew_it =
    "run `millrace trust renew` on the admin host, then copy the folder again";

tl::unexpected<std::string> refuse(const fs::path& file, std::string_view what,
                                   std::string_view do_this = ask_for_it) {
  return tl::unexpected(fmt::format("{}: {}; {}", file.string(), what, do_this));
}

tl::unexpected<std::string> refuse(const fs::path& file, const posix::FileFault& fault) {
  return refuse(file, fault.what, fault.advice.empty() ? ask_for_it : fault.advice);
}

Result<std::string> content_of(const fs::path& file,
                               posix::Secrecy secrecy = posix::Secrecy::open) {
  auto text = posix::read_guarded(file, secrecy);
  return text ? Result<std::string>(*std::move(text)) : refuse(file, text.error());
}

template <typename T>
Result<T> read_as(const fs::path& file, posix::Secrecy secrecy = posix::Secrecy::open) {
  return content_of(file, secrecy).and_then([&](const std::string& text) {
    return T::read(text).or_else(
        [&](const std::string& what) -> Result<T> { return refuse(file, what); });
  });
}

/// A document that the given CA has signed.
Result<std::string> document_in(const fs::path& file, const Certificate& authority) {
  return content_of(file).and_then([&](const std::string& text) -> Result<std::string> {
    auto verified = openssl::verified_text(text, authority);
    return verified ? Result<std::string>(*std::move(verified)) : refuse(file, verified.error());
  });
}

/// The CRL, if that CA has signed it.
Result<openssl::RevocationList> read_list(const fs::path& folder, const Certificate& authority) {
  auto list = read_as<openssl::RevocationList>(folder / files::revoked);
  if (list && !list->is_issued_by(authority)) {
    return refuse(folder / files::revoked,
                  fmt::format("is not signed by the CA in {}", files::identity_authority));
  }
  return list;
}

/// Returns the CRL.
Result<openssl::RevocationList> check_certificate(const fs::path& folder,
                                                  const Certificate& certificate, const Key& key,
                                                  std::chrono::sys_seconds now) {
  const fs::path file = folder / files::certificate;
  if (!certificate.belongs_to(key)) {
    return refuse(file, fmt::format("does not belong to the key in {}", files::key));
  }
  const auto authority = read_as<Certificate>(folder / files::identity_authority);
  if (!authority) {
    return tl::unexpected(authority.error());
  }
  if (now >= authority->until()) {
    return refuse(
        folder / files::identity_authority,
        fmt::format("expired on {:%F %R} UTC", authority->until()),
        "run `millrace trust renew-authorities` on the admin host, then copy the folder again");
  }
  if (!certificate.is_issued_by(*authority)) {
    return refuse(file, fmt::format("is not issued by the CA in {}", files::identity_authority));
  }
  if (now >= certificate.until()) {
    return refuse(file, fmt::format("expired on {:%F %R} UTC", certificate.until()), renew_it);
  }
  if (now < certificate.from()) {
    return refuse(file, fmt::format("is not valid before {:%F %R} UTC", certificate.from()),
                  "check the clock of this host");
  }
  auto revoked = read_list(folder, *authority);
  if (!revoked) {
    return revoked;
  }
  if (revoked->names(certificate)) {
    return refuse(file, "was revoked", "ask the administrator of the plant's PKI");
  }
  // Each certificate comes with a CRL of its own time, and every later CRL is newer.
  if (revoked->from() < certificate.from()) {
    return refuse(folder / files::revoked,
                  fmt::format("was made on {:%F %T} UTC, before the certificate: an older CRL was "
                              "copied over it, and later revocations are missing",
                              revoked->from()),
                  "copy the newest CRL from the admin host");
  }
  return revoked;
}

/// The governance is the same for all participants, and signed by the CA for permissions.
Result<void> check_governance(const fs::path& folder, Protection protection,
                              const Certificate& authority) {
  const fs::path file = folder / governance_file(protection);
  return document_in(file, authority).and_then([&](const std::string& document) -> Result<void> {
    if (is_governance(document, protection)) {
      return {};
    }
    const auto other = protection == Protection::sign ? Protection::encrypt : Protection::sign;
    return is_governance(document, other)
               ? refuse(file, fmt::format("is the governance of {}", name_of(other)))
               : refuse(file, "is not the governance that this version of millrace makes",
                        renew_it);
  });
}

/// The participant's permissions: signed by the CA for permissions, for this certificate and its
/// time. Returns the partitions of its identity.
Result<std::vector<std::string>> check_permissions(const fs::path& folder,
                                                   const Certificate& certificate,
                                                   const Certificate& authority) {
  using Partitions = Result<std::vector<std::string>>;
  const fs::path file = folder / files::permissions;
  return document_in(file, authority).and_then([&](const std::string& document) -> Partitions {
    if (const auto mismatch =
            mismatch_in(document, certificate.subject(), certificate.from(), certificate.until())) {
      return refuse(file, *mismatch);
    }
    std::vector<std::string> partitions = identity_partitions_in(document);
    if (partitions.empty()) {
      return refuse(file,
                    "was made by an earlier version of millrace: it has no rules for identities",
                    renew_it);
    }
    return partitions;
  });
}

/// Debian keeps Cyclone's plugins in a folder that the loader does not search, beside the library.
Result<fs::path> plugins() {
  Dl_info info{};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what dladdr() takes.
  if (::dladdr(reinterpret_cast<const void*>(&dds_create_participant), &info) == 0) {
    return tl::unexpected(std::string("cannot find the folder where Cyclone DDS is installed"));
  }
  std::error_code none;
  const fs::path beside = fs::canonical(info.dli_fname, none).parent_path();
  for (const fs::path& folder : {beside / "libddsc0debian", beside}) {
    if (fs::exists(folder / "libdds_security_auth.so", none)) {
      return folder;
    }
  }
  return tl::unexpected(fmt::format(
      "Cyclone's security plugins (libdds_security_auth.so) are not in {}; on Debian they are part "
      "of the package libddsc0debian",
      beside.string()));
}

std::string configuration_of(const fs::path& folder, Protection protection,
                             const fs::path& plugin_folder) {
  const auto library = [&](std::string_view plugin, std::string_view word) {
    return fmt::format(
        R"(<Library path="{}/libdds_security_{}.so" initFunction="init_{}" finalizeFunction="finalize_{}"/>)",
        base::text::xml_text(plugin_folder.string()), plugin, word, word);
  };
  const auto file = [&](std::string_view element, std::string_view name) {
    return fmt::format("<{0}>file:{1}</{0}>", element,
                       base::text::xml_text((folder / name).string()));
  };
  return fmt::format(
      "<Security><Authentication>{}{}{}{}{}</Authentication>"
      "<AccessControl>{}{}{}{}</AccessControl>"
      "<Cryptographic>{}</Cryptographic></Security>",
      library("auth", "authentication"), file("IdentityCA", files::identity_authority),
      file("IdentityCertificate", files::certificate), file("PrivateKey", files::key),
      file("CRL", files::revoked), library("ac", "access_control"),
      file("PermissionsCA", files::permissions_authority),
      file("Governance", governance_file(protection)), file("Permissions", files::permissions),
      library("crypto", "crypto"));
}

}  // namespace

std::string_view governance_file(Protection protection) {
  return protection == Protection::sign ? files::governance_sign : files::governance_encrypt;
}

tl::expected<Credentials, std::string> read_folder(const fs::path& given, Protection protection,
                                                   std::chrono::sys_seconds now) {
  std::error_code missing;
  const fs::path folder = fs::canonical(given, missing);
  if (missing || !fs::is_directory(folder)) {
    return refuse(given, "is not a folder");
  }
  if (std::error_code none; fs::is_directory(folder / "authorities", none)) {
    return refuse(folder, "is a PKI folder with the private keys of its CAs",
                  "keep it where only you can read it, and name the folder of one participant: a "
                  "host needs nothing else");
  }
  if (folder.string().find(',') != std::string::npos) {
    return refuse(folder, "has a comma in its name, which Cyclone's configuration cannot hold",
                  "move it");
  }
  if (const auto fault = posix::fault_of_folder(folder)) {
    return refuse(folder, *fault);
  }
  const auto certificate = read_as<Certificate>(folder / files::certificate);
  if (!certificate) {
    return tl::unexpected(certificate.error());
  }
  const auto key = read_as<Key>(folder / files::key, posix::Secrecy::secret);
  if (!key) {
    return tl::unexpected(key.error());
  }
  const auto revoked = check_certificate(folder, *certificate, *key, now);
  if (!revoked) {
    return tl::unexpected(revoked.error());
  }
  const auto authority = read_as<Certificate>(folder / files::permissions_authority);
  if (!authority) {
    return tl::unexpected(authority.error());
  }
  auto partitions = check_permissions(folder, *certificate, *authority);
  if (!partitions) {
    return tl::unexpected(partitions.error());
  }
  if (auto checked = check_governance(folder, protection, *authority); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto plugin_folder = plugins();
  if (!plugin_folder) {
    return tl::unexpected(plugin_folder.error());
  }
  return Credentials{.folder = given,
                     .name = certificate->common_name(),
                     .from = certificate->from(),
                     .until = certificate->until(),
                     .revoked = revoked->common_names(),
                     .revoked_as_of = revoked->from(),
                     .identity_partitions = *std::move(partitions),
                     .cyclone_configuration = configuration_of(folder, protection, *plugin_folder)};
}

tl::expected<std::set<std::string>, std::string> read_revoked(const fs::path& folder) {
  return read_as<Certificate>(folder / files::identity_authority)
      .and_then([&](const Certificate& authority) { return read_list(folder, authority); })
      .map([](const openssl::RevocationList& list) { return list.common_names(); });
}

}  // namespace millrace::fabric::trust
