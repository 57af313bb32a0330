// The register of a PKI (PKI/register.textproto): the certificates that its CAs have issued.
//
//   auto participants = read_register(folder);
//   describe(*participants->add_participant(), participant, options);
//   write_register(folder, *participants);
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

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

}  // namespace millrace::tools::trust
