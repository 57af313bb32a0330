#include "fabric/trust/folder.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include <dds/dds.h>
#include <dlfcn.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/revocations.hpp"
#include "base/openssl/signed_text.hpp"
#include "base/text/quoted.hpp"
#include "fabric/trust/permissions.hpp"

namespace millrace::fabric::trust {

namespace {

namespace fs = std::filesystem;
namespace openssl = base::openssl;
using openssl::Certificate;
using openssl::Key;

template <typename T>
using Result = tl::expected<T, std::string>;

constexpr std::string_view ask_for_it =
    "`millrace trust issue` makes all files of a member; copy its folder anew";

tl::unexpected<std::string> refuse(const fs::path& file, std::string_view what,
                                   std::string_view do_this = ask_for_it) {
  return tl::unexpected(fmt::format("{}: {}; {}", file.string(), what, do_this));
}

Result<std::string> content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad()) {
    return refuse(file, fmt::format("cannot be read ({})", std::strerror(errno)));
  }
  return text;
}

template <typename T>
Result<T> read_as(const fs::path& file) {
  return content_of(file).and_then([&](const std::string& text) {
    return T::read(text).or_else(
        [&](const std::string& what) -> Result<T> { return refuse(file, what); });
  });
}

Result<Key> read_key(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 && (status.st_mode & (S_IROTH | S_IWOTH)) != 0) {
    return refuse(file, "is the private key, and everybody on this host can read it",
                  "`chmod o= " + file.string() + "`, and issue it anew if others may have seen it");
  }
  return read_as<Key>(file);
}

/// What the one authority that counts has signed.
Result<std::string> document_in(const fs::path& file, const Certificate& authority) {
  return content_of(file).and_then([&](const std::string& text) -> Result<std::string> {
    auto verified = openssl::verified_text(text, authority);
    return verified ? Result<std::string>(*std::move(verified)) : refuse(file, verified.error());
  });
}

/// The list of those taken back, if that authority has signed it.
Result<openssl::RevocationList> read_list(const fs::path& folder, const Certificate& authority) {
  auto list = read_as<openssl::RevocationList>(folder / files::revoked);
  if (list && !list->is_issued_by(authority)) {
    return refuse(folder / files::revoked,
                  fmt::format("is not signed by the authority in {}", files::identity_authority));
  }
  return list;
}

Result<void> check_certificate(const fs::path& folder, const Certificate& certificate,
                               const Key& key, std::chrono::sys_seconds now) {
  const fs::path file = folder / files::certificate;
  if (!certificate.belongs_to(key)) {
    return refuse(file, fmt::format("does not belong to the key in {}", files::key));
  }
  const auto authority = read_as<Certificate>(folder / files::identity_authority);
  if (!authority) {
    return tl::unexpected(authority.error());
  }
  if (now >= authority->until()) {
    return refuse(folder / files::identity_authority,
                  fmt::format("expired on {:%F %R} UTC", authority->until()),
                  "`millrace trust renew-authorities` where they are, then copy the folder anew");
  }
  if (!certificate.is_issued_by(*authority)) {
    return refuse(file,
                  fmt::format("is not issued by the authority in {}", files::identity_authority));
  }
  if (now >= certificate.until()) {
    return refuse(
        file, fmt::format("expired on {:%F %R} UTC", certificate.until()),
        "`millrace trust renew` where the plant's authorities are, then copy the folder anew");
  }
  if (now < certificate.from()) {
    return refuse(file, fmt::format("is not valid before {:%F %R} UTC", certificate.from()),
                  "look at this host's clock");
  }
  const auto revoked = read_list(folder, *authority);
  if (!revoked) {
    return tl::unexpected(revoked.error());
  }
  if (revoked->names(certificate)) {
    return refuse(file, "has been revoked", "ask who answers for the plant's trust");
  }
  return {};
}

/// Debian keeps Cyclone's plugins in a folder that the loader does not search, beside the library.
Result<fs::path> plugins() {
  Dl_info info{};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what dladdr() takes.
  if (::dladdr(reinterpret_cast<const void*>(&dds_create_participant), &info) == 0) {
    return tl::unexpected(std::string("cannot find out where Cyclone DDS is installed"));
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
    return refuse(given, "is no folder");
  }
  if (folder.string().find(',') != std::string::npos) {
    return refuse(folder, "has a comma in its name, which Cyclone's configuration cannot hold",
                  "move it");
  }
  const auto certificate = read_as<Certificate>(folder / files::certificate);
  if (!certificate) {
    return tl::unexpected(certificate.error());
  }
  const auto key = read_key(folder / files::key);
  if (!key) {
    return tl::unexpected(key.error());
  }
  if (auto checked = check_certificate(folder, *certificate, *key, now); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto authority = read_as<Certificate>(folder / files::permissions_authority);
  if (!authority) {
    return tl::unexpected(authority.error());
  }
  const auto permissions = document_in(folder / files::permissions, *authority);
  if (!permissions) {
    return tl::unexpected(permissions.error());
  }
  std::vector<std::string> badge = badge_in(*permissions);
  if (badge.empty()) {
    return refuse(folder / files::permissions,
                  "is of an earlier version of millrace: it says nothing of a badge",
                  "`millrace trust renew` where the plant's authorities are, then copy the folder "
                  "anew");
  }
  if (auto checked = document_in(folder / governance_file(protection), *authority); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto plugin_folder = plugins();
  if (!plugin_folder) {
    return tl::unexpected(plugin_folder.error());
  }
  return Credentials{.name = certificate->common_name(),
                     .from = certificate->from(),
                     .until = certificate->until(),
                     .badge = std::move(badge),
                     .cyclone_configuration = configuration_of(folder, protection, *plugin_folder)};
}

tl::expected<std::set<std::string>, std::string> read_revoked(const fs::path& folder) {
  return read_as<Certificate>(folder / files::identity_authority)
      .and_then([&](const Certificate& authority) { return read_list(folder, authority); })
      .map([](const openssl::RevocationList& list) { return list.common_names(); });
}

}  // namespace millrace::fabric::trust
