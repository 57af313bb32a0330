// The register of a plant's trust (PLANT/register.textproto): whom its authorities have believed
// what.
//
//   auto members = read_register(folder);
//   describe(*members->add_member(), member, options);
//   write_register(folder, *members);
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "tools/trust/plant.hpp"

namespace millrace::tools::trust {

/// Its name in the folder.
inline constexpr const char* register_name = "register.textproto";

/// The error says what the folder is not, or has the mistakes of the file.
tl::expected<std::unique_ptr<config::TrustRegister>, std::string> read_register(
    const std::filesystem::path& folder);
tl::expected<void, std::string> write_register(const std::filesystem::path& folder,
                                               const config::TrustRegister& members);

/// Has the record say what the member may, and where it is meant to be.
void describe(config::TrustMember& record, const fabric::trust::Member& member,
              const IssueOptions& options);
Entry entry_of(const config::TrustMember& record);
/// Whether it has got something, and all of that has been taken back.
bool is_revoked(const config::TrustMember& record);
/// Every certificate that has been taken back, whosoever it was.
std::vector<base::openssl::Revoked> revoked_in(const config::TrustRegister& members);

}  // namespace millrace::tools::trust
