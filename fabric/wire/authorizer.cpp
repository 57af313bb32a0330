#include "fabric/wire/authorizer.hpp"

#include <fmt/format.h>

#include "fabric/alarm.hpp"
#include "fabric/command.hpp"
#include "fabric/variables.hpp"

namespace millrace::fabric::wire {

Authorization Authorizer::authorize(dds_instance_handle_t writer,
                                    const AuthorizationScope& scope) const {
  const IdentityStatus status = authenticator_->of_writer(writer);
  const bool testers = scope.testers && !authenticator_->has_gateway_of(scope.machine);
  return authorization_of(status, scope.machine, testers);
}

bool Authorizer::speaks_for(dds_instance_handle_t writer, std::string_view machine) const {
  return authorization_of(authenticator_->of_writer(writer), machine) == Authorization::granted;
}

void Authorizer::warn_limited(dds_instance_handle_t writer, const AuthorizationScope& scope,
                              const char* topic) const {
  const IdentityStatus status = authenticator_->of_writer(writer);
  const Authorization authorization = authorize(writer, scope);
  const std::string machine =
      authorization == Authorization::other_machine ? std::string(scope.machine) : "";
  const std::string who =
      status.identity ? status.identity->name
                      : fmt::format("participant {}", authenticator_->name_of_writer(writer));
  const std::string denial = denial_of(status, authorization, scope.machine);
  authenticator_->warn_limited(
      fmt::format("{}/{}/{}", who, machine, topic),
      fmt::format("{}{}: its samples on {} are ignored", denial,
                  status.identity ? "" : fmt::format(" ({})", who), topic));
}

std::uint64_t Authorizer::requester_of(dds_instance_handle_t writer,
                                       std::string_view machine) const {
  if (authenticator_ == nullptr) {
    return writer;
  }
  const IdentityStatus status = authenticator_->of_writer(writer);
  const bool speaks_for_it = speaks_for(writer, machine);
  constexpr std::uint64_t gateways = 1;
  return speaks_for_it || !status.identity ? gateways
                                           : std::hash<std::string>{}(status.identity->name) | 2U;
}

std::string Authorizer::certificate_name_of(dds_instance_handle_t writer) const {
  if (authenticator_ == nullptr) {
    return {};
  }
  const IdentityStatus status = authenticator_->of_writer(writer);
  return status.identity ? status.identity->name : std::string();
}

void apply_certificate(Command& value, const Authorizer& authorizer, dds_instance_handle_t writer) {
  value.issuer = issuer_of(authorizer.certificate_name_of(writer), value.issuer);
}

void apply_certificate(Alarm& value, const Authorizer& authorizer, dds_instance_handle_t writer) {
  value.program = issuer_of(authorizer.certificate_name_of(writer), value.program);
}

void apply_certificate(VariableRequest& value, const Authorizer& authorizer,
                       dds_instance_handle_t writer) {
  value.issuer = issuer_of(authorizer.certificate_name_of(writer), value.issuer);
}

}  // namespace millrace::fabric::wire
