// What a program of a fabric with trust has proved to be, and what it may say therefore. Pure.
//
//   identity_partitions("millrace", {"gateway-1", {"gateway"}, {"press_1"}})
//   // millrace/@name/gateway-1, millrace/@role/gateway, millrace/@machine/press_1
//
// DDS Security lets a program have endpoints in the partitions that its permissions name, and in no
// others, and each one who is matched with an endpoint checks that himself. So an identity is a
// writer of a topic without samples, in partitions that say who somebody is: whoever sees it
// matched knows that it is true. It is the first endpoint of a program, and DDS tells of endpoints
// in their order: it is known before anything that the program says.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::fabric {

/// The topic; its type is in idl/identity.idl.
inline constexpr const char* identity_topic_name = "millrace/identity";

struct ParticipantIdentity {
  /// The common name of the certificate.
  std::string name{};
  /// As `millrace trust issue --role` has them.
  std::set<std::string> roles{};
  /// Of a gateway: the machines that it may speak for.
  std::set<std::string> machines{};
  bool operator==(const ParticipantIdentity&) const = default;
};

/// Where its writer is, all of them at once.
std::vector<std::string> identity_partitions(std::string_view fabric,
                                             const ParticipantIdentity& identity);
/// The partition of who reads identities.
std::string identity_readers_partition(std::string_view fabric);
/// What a writer in these partitions shows; nothing if it is no identity of this fabric with one
/// name.
std::optional<ParticipantIdentity> parse_participant_identity(
    std::string_view fabric, const std::vector<std::string>& partitions);

/// Which process a program with an identity is. Everybody can read what a participant announces,
/// with ENCRYPT too, so this is told in the user_data of the identity's writer, to who is believed.
struct ProcessInfo {
  std::string program{};
  std::string host{};
  std::uint32_t pid = 0;
  bool operator==(const ProcessInfo&) const = default;
};

/// "17\nhall-pc\narchiver"
std::string format_process_info(const ProcessInfo& where);
/// Nothing if it is not of this form: an identity need not say it.
std::optional<ProcessInfo> parse_process_info(std::string_view user_data);

/// What is known of a program.
struct IdentityStatus {
  /// Null: it has shown none.
  std::shared_ptr<const ParticipantIdentity> identity{};
  /// Its certificate has been taken back since.
  bool revoked = false;
};

enum class Authorization : std::uint8_t {
  granted,
  /// It has shown nothing.
  unauthenticated,
  revoked,
  /// It speaks for a machine that its certificate does not name.
  other_machine
};

/// Whose word it is to say something of `machine`, or of one of its queues (empty: something that
/// is of no machine). `testers`: also of who replays calls and data of machines.
Authorization authorization_of(const IdentityStatus& status, std::string_view machine = {},
                               bool testers = false);

/// Why it does not count, for people: "gateway-2 speaks for press_1, which its certificate does not
/// name".
std::string denial_of(const IdentityStatus& status, Authorization authorization,
                      std::string_view machine);

/// Who a command is from: the name in the certificate comes first, whatever the command says:
/// "office (anna@hall-pc)". Without trust, `certificate` empty, what it says.
std::string issuer_of(const std::string& certificate, const std::string& said);

}  // namespace millrace::fabric
