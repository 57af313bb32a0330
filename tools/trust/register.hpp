// The register of a plant's trust (PKI/register.textproto): whom its authorities have believed
// what.
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

/// Its name in the folder.
inline constexpr const char* register_name = "register.textproto";

/// The error says what the folder is not, or has the mistakes of the file.
tl::expected<std::unique_ptr<config::TrustRegister>, std::string> read_register(
    const std::filesystem::path& folder);
tl::expected<void, std::string> write_register(const std::filesystem::path& folder,
                                               const config::TrustRegister& participants);

/// Has the record say what the participant may, and where it is meant to be.
void describe(config::TrustParticipant& record, const fabric::trust::Participant& participant,
              const IssueOptions& options);
Entry entry_of(const config::TrustParticipant& record);
/// Whether it has got something, and all of that has been taken back.
bool is_revoked(const config::TrustParticipant& record);
/// Every certificate that has been taken back, whosoever it was.
std::vector<base::openssl::Revoked> revoked_in(const config::TrustRegister& participants);

}  // namespace millrace::tools::trust
