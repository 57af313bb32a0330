// The protection of a whole fabric, the same for all its participants: the governance document of
// DDS Security. Pure.
//
//   sign_text(governance_document(Protection::sign), authority, key);
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::fabric::trust {

enum class Protection : std::uint8_t {
  /// Samples cannot be changed or forged; any listener can read them.
  sign,
  /// Nor read it.
  encrypt
};

/// "SIGN", "ENCRYPT".
std::string_view name_of(Protection protection);
std::optional<Protection> protection_named(std::string_view name);

/// Cyclone's plugins know no domains beyond this one.
inline constexpr std::uint32_t last_domain = 230;

/// All topics of all domains; participants need credentials, and each endpoint is checked.
std::string governance_document(Protection protection);

/// Whether a document that has been signed is the one above; line ends do not count, which signing
/// changes.
bool is_governance(std::string_view document, Protection protection);

}  // namespace millrace::fabric::trust
