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

/// How processes find each other where multicast does it.
enum class Finding : std::uint8_t {
  /// Gateways and tools: in the group, hears everybody.
  hears,
  /// Services: not in the group, only announce themselves to it, several times a second. Those that
  /// hear answer. So services do not find each other, who have nothing to say to each other: if all
  /// find all, that costs the square of their number.
  announces
};

struct ParticipantOptions {
  std::uint32_t domain = 0;
  /// The fabric's name, first element of each partition.
  std::string fabric = "millrace";
  /// How soon those who give it work notice that this process is gone without a word, or hangs: its
  /// instances send heartbeats, and a gateway asserts itself, several times in it.
  std::chrono::milliseconds lease{500};
  /// After this time without a word DDS takes a process for gone; not shorter than `lease`. DDS's
  /// ordinary one: with a shorter one each process announces itself to all others so much more
  /// often, and Cyclone 0.10.2 crashes if it ends while the process' endpoints are being found.
  /// Nothing: 10 s for who only announces itself; 100 s for who hears, because who has lost one
  /// that he does not hear would not find it again while it believes in him.
  std::optional<std::chrono::milliseconds> participant_lease{};
  Finding finding = Finding::hears;
  /// What `ps`-like tools show.
  std::string name{};
  /// Further Cyclone configuration (XML fragments or files, with commas between); wins over ours.
  /// CYCLONEDDS_URI takes its place if it is empty and is ignored otherwise. The fabric stays on
  /// loopback unless the one that applies names an interface.
  std::string configuration{};
  /// What the certificate says that `configuration` shows the others; null without trust.
  std::shared_ptr<const Trust> trust{};
};

/// True for some text without '*', '?', '/' and ',', which mean something in partitions.
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
  /// What the others have proved to be; null without trust. From any thread.
  [[nodiscard]] Authenticator* authenticator() const { return authenticator_.get(); }

 private:
  void leave();

  ParticipantOptions options_;
  std::int32_t handle_ = 0;
  std::unique_ptr<Authenticator> authenticator_;
};

}  // namespace millrace::fabric::dds
