// The register of a PKI (PKI/register.textproto): the certificates that its CAs have issued.
//
//   auto participants = read_register(folder);
//   describe(*participants->add_participant(), participant, options);
//   write_register(folder, *participants);
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "tools/trust/certificate_authorities.hpp"
#include "tools/trust/pki_folder.hpp"

namespace millrace::tools::trust {

/// Its file name in the folder.
inline constexpr const char* register_name = "register.textproto";

/// The error says why it is not a PKI folder, or lists the mistakes of the file.
tl::expected<std::unique_ptr<config::TrustRegister>, std::string> read_register(
    const std::filesystem::path& folder);
tl::expected<void, std::string> write_register(const std::filesystem::path& folder,
                                               const config::TrustRegister& participants);

/// Writes the participant's permissions and note into the record.
void describe(config::TrustParticipant& record, const fabric::trust::Participant& participant,
              const IssueOptions& options);
Entry entry_of(const config::TrustParticipant& record);
/// Whether it has certificates, and all of them were revoked.
bool is_revoked(const config::TrustParticipant& record);
/// All revoked certificates, of any participant.
std::vector<base::openssl::Revoked> revoked_in(const config::TrustRegister& participants);

// A participant's folder: written completely or not at all, and packed for its host.

/// Replaces the contents of `folder` with `files`: a reader sees either the old or the new ones.
/// Only the owner can read the secret ones. The error names the file.
tl::expected<void, std::string> write_participant_folder(
    const std::filesystem::path& folder, const std::vector<CredentialFiles::File>& files);

/// Removes what an interrupted command has left in the PKI folder: unused keys.
void remove_unfinished(const std::filesystem::path& plant);

/// A tar archive (POSIX ustar) of the plain files in `folder`, below `name`/, with their modes and
/// no owner.
tl::expected<std::string, std::string> tar_of(const std::filesystem::path& folder,
                                              std::string_view name);

}  // namespace millrace::tools::trust
