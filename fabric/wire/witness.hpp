// Whom a reader believes what, where there is trust: DDS has checked that a writer may write its
// topic, not of which machine it speaks.
//
//   Witness witness(participant);
//   if (witness.judge(writer, claim_of(value), topic) == Standing::believed) …
//
// One lookup of two tables for each sample; nothing without trust.
#pragma once

#include <string>

#include "fabric/badge.hpp"
#include "fabric/data.hpp"
#include "fabric/dds/badges.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric {
struct Command;
struct Notice;
struct VariableRequest;
}  // namespace millrace::fabric

namespace millrace::fabric::wire {

/// What a sample says that is somebody's to say.
struct Claim {
  /// Of which machine it speaks; empty: of none.
  std::string_view machine{};
  /// A tester may say it, too, unless a gateway of the machine is there.
  bool testers = false;
};

/// Whoever is of the plant may say it.
template <typename Value>
Claim claim_of(const Value& value) {
  static_cast<void>(value);
  return {};
}
inline Claim claim_of(const Request& value) {
  return {value.key.machine, true};
}
inline Claim claim_of(const Event& value) {
  return {value.key.machine, true};
}
inline Claim claim_of(const DataSample& value) {
  return {value.key.machine, true};
}
inline Claim claim_of(const ProgramEvent& value) {
  return {value.key.machine, true};
}
inline Claim claim_of(const ChannelStatus& value) {
  return {value.key.machine};
}
inline Claim claim_of(const MachineStatus& value) {
  return {value.machine};
}

class Witness {
 public:
  explicit Witness(const dds::Participant& participant) : badges_(participant.badges()) {}

  /// False without trust: then everybody is believed.
  [[nodiscard]] bool asks() const { return badges_ != nullptr; }
  [[nodiscard]] dds::Badges* badges() const { return badges_; }
  /// Also of who has left lately, whose last words may be untaken.
  [[nodiscard]] Standing judge(dds_instance_handle_t writer, const Claim& claim) const;
  /// The writer belongs to a gateway whose certificate names this machine.
  [[nodiscard]] bool speaks_for(dds_instance_handle_t writer, std::string_view machine) const;
  /// Has it said that this is not believed.
  void complain(dds_instance_handle_t writer, const Claim& claim, const char* topic) const;
  /// Who asks with this writer for `machine`, as a number: with trust the same of all that may
  /// speak for the machine, since one of them may go on with what another one has begun, and of
  /// anybody else what its certificate is called; without trust the writer itself.
  [[nodiscard]] std::uint64_t asker_of(dds_instance_handle_t writer,
                                       std::string_view machine) const;
  /// The name in the certificate of who has this writer; empty without trust.
  [[nodiscard]] std::string certificate_of(dds_instance_handle_t writer) const;

 private:
  dds::Badges* badges_;
};

/// What the certificate of its writer says better than a sample itself: from whom it is, and
/// whether it is of a machine or of a tester (`replayed`).
template <typename Value>
void apply_certificate(Value& value, const Witness& witness, dds_instance_handle_t writer) {
  if constexpr (requires { value.replayed; }) {
    const Claim claim = claim_of(value);
    value.replayed =
        value.replayed || (claim.testers && !witness.speaks_for(writer, claim.machine));
  }
}
void apply_certificate(Command& value, const Witness& witness, dds_instance_handle_t writer);
void apply_certificate(Notice& value, const Witness& witness, dds_instance_handle_t writer);
void apply_certificate(VariableRequest& value, const Witness& witness,
                       dds_instance_handle_t writer);

}  // namespace millrace::fabric::wire
