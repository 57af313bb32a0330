// The PKI folder: its CAs, a register of issued certificates, and a folder for each participant
// with only the files that it needs.
//
//   auto pki = PkiFolder::open("plant", {});
//   pki->issue({.name = "square-root", .roles = {Role::service}, .uuids = {"560aacbf-…"}}, {.days
//   = 825}, now);
//
//   plant/authorities/       never leaves the admin host
//   plant/register.textproto
//   plant/revoked.pem        the newest list of revoked participants, the same as in their folders
//   plant/square-root/       goes to the host of that service
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "base/posix/system.hpp"
#include "tools/trust/certificate_authorities.hpp"

namespace millrace::config {
class TrustParticipant;
class TrustRegister;
}  // namespace millrace::config

namespace millrace::tools::trust {

/// A participant in the register.
struct Entry {
  fabric::trust::Participant participant;
  /// A note about its host, for people.
  std::string host;
  /// Of the certificate in its folder.
  std::string serial;
  Time from;
  Time until;
  /// All its certificates were revoked.
  bool revoked = false;
  /// A process with another DDS.
  bool foreign = false;
};

struct IssueOptions {
  std::string host{};
  /// Validity of the certificate, in days; never longer than the CAs'.
  int days = 825;
  /// For a process with another DDS.
  bool foreign = false;
};

/// Holds the folder's lock while it may write; two commands do not write at once. Errors are for
/// people and name the file.
class PkiFolder {
 public:
  /// Creates the folder, which must not exist or be empty: CAs are never overwritten. After an
  /// error it is removed.
  static tl::expected<void, std::string> create(const std::filesystem::path& folder,
                                                std::string_view name, std::string_view fabric,
                                                int days, std::string_view passphrase, Time now);
  static tl::expected<PkiFolder, std::string> open(const std::filesystem::path& folder);
  /// Read-only, also while another command writes, and in a folder without write access.
  static tl::expected<PkiFolder, std::string> look(const std::filesystem::path& folder);
  PkiFolder(PkiFolder&&) noexcept;
  PkiFolder& operator=(PkiFolder&&) noexcept;
  ~PkiFolder();

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] const std::string& fabric() const;
  /// By name.
  [[nodiscard]] std::vector<Entry> entries() const;
  [[nodiscard]] tl::expected<Entry, std::string> entry(std::string_view name) const;
  /// The folder of a participant: plant/NAME.
  [[nodiscard]] std::filesystem::path folder_of(std::string_view name) const;

  /// A new participant; refused if the name exists.
  tl::expected<Entry, std::string> issue(const fabric::trust::Participant& participant,
                                         const IssueOptions& options, std::string_view passphrase,
                                         Time now);
  /// renew() with other permissions: roles, UUIDs and machines become those of `participant`; an
  /// omitted host and `foreign` stay the same.
  tl::expected<Entry, std::string> reissue(const fabric::trust::Participant& participant,
                                           const IssueOptions& options, std::string_view passphrase,
                                           Time now);
  /// A new key, certificate and permissions; the host's present ones stay valid until they expire.
  tl::expected<Entry, std::string> renew(std::string_view name, int days,
                                         std::string_view passphrase, Time now);
  /// Renews the CAs for this number of days from now with their keys, then every participant that
  /// is not revoked, like renew(): certificates on hosts and new ones stay valid for each other. An
  /// error may leave some participants as they were; a repeat continues.
  tl::expected<void, std::string> renew_authorities(int days, int participant_days,
                                                    std::string_view passphrase, Time now);
  /// Validity of the CAs, and so whatever they sign.
  [[nodiscard]] tl::expected<Time, std::string> authorities_until() const;
  /// Revokes all certificates of the participant, and updates the CRL in all participants' folders.
  /// An error may leave some without it; a repeat continues.
  tl::expected<void, std::string> revoke(std::string_view name, std::string_view passphrase,
                                         Time now);
  /// The participant's folder as a tar archive, for its host.
  [[nodiscard]] tl::expected<std::string, std::string> archive_of(std::string_view name) const;

 private:
  PkiFolder(std::filesystem::path folder, base::posix::Fd lock,
            std::unique_ptr<config::TrustRegister> participants);

  [[nodiscard]] const config::TrustParticipant* find(std::string_view name) const;
  config::TrustParticipant* find_to_change(std::string_view name);
  tl::expected<Entry, std::string> make(config::TrustParticipant& record, int days,
                                        const CertificateAuthorities& authorities, Time now);
  [[nodiscard]] tl::expected<void, std::string> save() const;
  /// The CRL, newly signed, for all folders.
  [[nodiscard]] tl::expected<void, std::string> spread_list(
      const CertificateAuthorities& authorities, Time now) const;
  [[nodiscard]] tl::expected<CertificateAuthorities, std::string> authorities(
      std::string_view passphrase) const;
  tl::expected<Entry, std::string> make_and_report(config::TrustParticipant& record, int days,
                                                   std::string_view passphrase, Time now);

  std::filesystem::path folder_;
  base::posix::Fd lock_;
  std::unique_ptr<config::TrustRegister> register_;
};

}  // namespace millrace::tools::trust
