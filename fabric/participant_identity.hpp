// The proved identity of a process on a fabric with trust, and what it may therefore publish. Pure.
//
//   identity_partitions("millrace", {"gateway-1", {"gateway"}, {"press_1"}})
//   // millrace/@name/gateway-1, millrace/@role/gateway, millrace/@machine/press_1
//
// DDS Security lets a participant have endpoints only in the partitions of its permissions, and
// each participant that is matched with an endpoint checks that. So an identity is a writer of a
// topic without samples, in partitions with the participant's name, roles and machines: a match
// proves them. It is the first endpoint of a process, and DDS announces endpoints in order: so the
// identity is known before any sample of the process.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/messages/message.hpp"
#include "fabric/process_version.hpp"

namespace millrace::fabric {

/// The topic; its type is in idl/identity.idl.
inline constexpr const char* identity_topic_name = "millrace/v5/identity";

struct ParticipantIdentity {
  /// The common name of the certificate.
  std::string name{};
  /// As `millrace trust issue --role` has them.
  std::set<std::string> roles{};
  /// Of a gateway: the machines that it may speak for.
  std::set<std::string> machines{};
  bool operator==(const ParticipantIdentity&) const = default;
};

/// The partitions of the identity's writer.
std::vector<std::string> identity_partitions(std::string_view fabric,
                                             const ParticipantIdentity& identity);
/// The partition of the readers of identities.
std::string identity_readers_partition(std::string_view fabric);
/// The identity in these partitions; nullopt if they are not an identity of this fabric with one
/// name.
std::optional<ParticipantIdentity> parse_participant_identity(
    std::string_view fabric, const std::vector<std::string>& partitions);

/// The process of an identity. Every process can read what a participant announces, also with
/// ENCRYPT, so this is in the user_data of the identity's writer, which only trusted participants
/// read.
struct ProcessInfo {
  std::string program{};
  std::string host{};
  std::uint32_t pid = 0;
  ProcessVersion version{};
  bool operator==(const ProcessInfo&) const = default;
};

/// "17\nhall-pc\narchiver\n", and its version.
std::string format_process_info(const ProcessInfo& where);
/// Nothing if it is not of this form: an identity need not say it.
std::optional<ProcessInfo> parse_process_info(std::string_view user_data);

/// What is known about a participant.
struct IdentityStatus {
  /// Null: it has announced none.
  std::shared_ptr<const ParticipantIdentity> identity{};
  /// Its certificate was revoked since.
  bool revoked = false;
};

enum class Authorization : std::uint8_t {
  granted,
  /// It has proved nothing.
  unauthenticated,
  revoked,
  /// It speaks for a machine that its certificate does not name.
  other_machine
};

/// Whether a participant may publish about `machine` or one of its queues (empty: about no
/// machine). `testers`: also participants that replay calls and data of machines.
Authorization authorization_of(const IdentityStatus& status, std::string_view machine = {},
                               bool testers = false);

/// Why it is rejected, for people: "gateway-2 speaks for press_1, which its certificate does not
/// name".
std::string denial_of(const IdentityStatus& status, Authorization authorization,
                      std::string_view machine);

/// The issuer of a command: the name in the certificate comes first, then the command's own:
/// "office (anna@hall-pc)". Without trust (`certificate` empty) the command's own.
std::string issuer_of(const std::string& certificate, const std::string& claimed);

// When the expiry of a certificate needs a warning, and how far off it is. Pure.

/// Time enough to renew a certificate and to go to its host.
inline constexpr std::chrono::days certificate_expires_soon{30};

/// "30 days"; in the last two days "40 hours".
base::messages::Message time_left(std::chrono::sys_seconds until, std::chrono::sys_seconds now);

}  // namespace millrace::fabric
