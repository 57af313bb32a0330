// Which samples a reader accepts on a fabric with trust: DDS has checked that a writer may write
// its topic, not for which machine.
//
//   Authorizer authorizer(participant);
//   if (authorizer.authorize(writer, authorization_scope_of(value), topic) == Authorization::granted) …
//
// One lookup of two tables for each sample; nothing without trust.
#pragma once

#include <string>

#include "fabric/data.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::fabric {
struct Command;
struct Alarm;
struct VariableRequest;
}  // namespace millrace::fabric

namespace millrace::fabric::wire {

/// What a sample claims to speak for.
struct AuthorizationScope {
  /// The machine that it speaks for; empty: none.
  std::string_view machine{};
  /// A tester may publish it too, unless a gateway of the machine is present.
  bool testers = false;
};

/// Every participant of the fabric may write it.
template <typename Value>
AuthorizationScope authorization_scope_of(const Value& value) {
  static_cast<void>(value);
  return {};
}
inline AuthorizationScope authorization_scope_of(const Request& value) {
  return {value.key.machine, true};
}
inline AuthorizationScope authorization_scope_of(const Event& value) {
  return {value.key.machine, true};
}
inline AuthorizationScope authorization_scope_of(const DataSample& value) {
  return {value.key.machine, true};
}
inline AuthorizationScope authorization_scope_of(const ProgramEvent& value) {
  return {value.key.machine, true};
}
inline AuthorizationScope authorization_scope_of(const ChannelStatus& value) {
  return {value.key.machine};
}
inline AuthorizationScope authorization_scope_of(const MachineStatus& value) {
  return {value.machine};
}

class Authorizer {
 public:
  explicit Authorizer(const dds::Participant& participant)
      : authenticator_(participant.authenticator()) {}

  /// False without trust: then every sample is accepted.
  [[nodiscard]] bool enabled() const { return authenticator_ != nullptr; }
  [[nodiscard]] dds::Authenticator* authenticator() const { return authenticator_; }
  /// Also for participants that left lately, whose last samples may still be untaken.
  [[nodiscard]] Authorization authorize(dds_instance_handle_t writer,
                                        const AuthorizationScope& scope) const;
  /// The writer belongs to a gateway whose certificate names this machine.
  [[nodiscard]] bool speaks_for(dds_instance_handle_t writer, std::string_view machine) const;
  /// Logs that a sample was rejected.
  void warn_limited(dds_instance_handle_t writer, const AuthorizationScope& scope,
                    const char* topic) const;
  /// The requester with this writer for `machine`, as a number: with trust the same for all
  /// participants that may speak for the machine, since one of them may continue what another
  /// began, and otherwise a number of its certificate's name; without trust the writer itself.
  [[nodiscard]] std::uint64_t requester_of(dds_instance_handle_t writer,
                                           std::string_view machine) const;
  /// The name in the certificate of this writer; empty without trust.
  [[nodiscard]] std::string certificate_name_of(dds_instance_handle_t writer) const;

 private:
  dds::Authenticator* authenticator_;
};

/// Sets what the writer's certificate proves and the sample only claims: its sender, and whether it
/// comes from a machine or a tester (`replayed`).
template <typename Value>
void apply_certificate(Value& value, const Authorizer& authorizer, dds_instance_handle_t writer) {
  if constexpr (requires { value.replayed; }) {
    const AuthorizationScope scope = authorization_scope_of(value);
    value.replayed =
        value.replayed || (scope.testers && !authorizer.speaks_for(writer, scope.machine));
  }
}
void apply_certificate(Command& value, const Authorizer& authorizer, dds_instance_handle_t writer);
void apply_certificate(Alarm& value, const Authorizer& authorizer, dds_instance_handle_t writer);
void apply_certificate(VariableRequest& value, const Authorizer& authorizer,
                       dds_instance_handle_t writer);

}  // namespace millrace::fabric::wire
