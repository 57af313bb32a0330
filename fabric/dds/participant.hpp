// A DDS domain participant, pinned to loopback unless something names an interface.
//
//   Participant participant({.domain = 0});
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace millrace::fabric::dds {

struct ParticipantOptions {
  std::uint32_t domain = 0;
  /// The fabric's name, first element of each partition.
  std::string fabric = "millrace";
  /// How soon others notice that this process is gone without a word.
  std::chrono::milliseconds lease{500};
  /// What `ps`-like tools show.
  std::string name{};
  /// Further Cyclone configuration (XML fragments or files, with commas between); wins over ours
  /// and gives way to CYCLONEDDS_URI. The fabric stays on loopback unless one of them names an
  /// interface.
  std::string configuration{};
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

 private:
  ParticipantOptions options_;
  std::int32_t handle_ = 0;
};

}  // namespace millrace::fabric::dds
