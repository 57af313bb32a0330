// A DDS domain participant, pinned to loopback unless something names an interface.
//
//   Participant participant({.domain = 0});
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::fabric::dds {

class Authenticator;
struct Trust;

/// How processes find each other with multicast.
enum class Finding : std::uint8_t {
  /// Gateways and tools: in the group, receives all others.
  discovers,
  /// Services: they are not in the discovery group and only announce themselves to it, several
  /// times a second. Processes in the group respond. So services, which do not communicate with
  /// each other, do not discover each other: discovery between all would cost the square of their
  /// number.
  announces
};

/// With trust, DDS's leases of processes: all alike, since a participant that alone has lost
/// another one needs a new one (fabric/one_sided_loss.hpp). That is to be a tool, else the gateway:
/// a service may be part of a user's process.
inline constexpr std::chrono::seconds trusted_service_lease{100};
inline constexpr std::chrono::seconds trusted_gateway_lease{105};
inline constexpr std::chrono::seconds trusted_tool_lease{110};

struct ParticipantOptions {
  std::uint32_t domain = 0;
  /// The fabric's name, the first element of each partition.
  std::string fabric = "millrace";
  /// How soon it is noticed that this process ended without leaving, or hangs: within this time its
  /// instances send several heartbeats, and a gateway asserts itself several times.
  std::chrono::milliseconds lease{500};
  /// After this time without a packet DDS takes a process for gone; not shorter than `lease`. This
  /// is DDS's own lease: with a shorter one each process announces itself to all others more often,
  /// and Cyclone 0.10.2 crashes if it ends while the endpoints of the process are being discovered.
  /// Nullopt: 10 s for a process that only announces itself, 100 s for one in the discovery group,
  /// since one that has lost a process which it does not receive would not find it again while it
  /// still has that process's entry. With trust trusted_service_lease and trusted_tool_lease.
  std::optional<std::chrono::milliseconds> participant_lease{};
  Finding finding = Finding::discovers;
  /// The name that tools show.
  std::string name{};
  /// Further Cyclone configuration (XML fragments or files, separated by commas); it overrides
  /// ours. If it is empty, CYCLONEDDS_URI is used instead, otherwise CYCLONEDDS_URI is ignored. The
  /// fabric stays on loopback unless the configuration names an interface.
  std::string configuration{};
  /// The contents of the certificate in `configuration`; null without trust.
  std::shared_ptr<const Trust> trust{};
};

/// True for a non-empty text without '*', '?', '/' and ',', which have a meaning in partitions.
bool is_fabric_name(std::string_view name);

/// RAII; throws std::runtime_error with Cyclone's reason if the domain cannot be joined, and
/// std::invalid_argument for a fabric's name with a wildcard, a '/' or nothing in it.
/// Participants of one process on one domain share the configuration of the first.
/// Create it before the process owns 1024 descriptors: Cyclone 0.10 waits with select().
class Participant {
 public:
  explicit Participant(ParticipantOptions options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Cyclone's entity handle (dds_entity_t).
  [[nodiscard]] std::int32_t handle() const { return handle_; }
  [[nodiscard]] const ParticipantOptions& options() const { return options_; }
  /// The identities of the others; null without trust. From any thread.
  [[nodiscard]] Authenticator* authenticator() const { return authenticator_.get(); }

 private:
  void leave();

  ParticipantOptions options_;
  std::int32_t handle_ = 0;
  std::unique_ptr<Authenticator> authenticator_;
};

}  // namespace millrace::fabric::dds
