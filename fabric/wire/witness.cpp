#include "fabric/wire/witness.hpp"

#include <fmt/format.h>

#include "fabric/command.hpp"
#include "fabric/notice.hpp"
#include "fabric/variables.hpp"

namespace millrace::fabric::wire {

Standing Witness::judge(dds_instance_handle_t writer, const Claim& claim) const {
  const Proof proof = badges_->of_writer(writer);
  const bool testers = claim.testers && !badges_->has_gateway_of(claim.machine);
  return standing_of(proof, claim.machine, testers);
}

bool Witness::speaks_for(dds_instance_handle_t writer, std::string_view machine) const {
  return standing_of(badges_->of_writer(writer), machine) == Standing::believed;
}

void Witness::complain(dds_instance_handle_t writer, const Claim& claim, const char* topic) const {
  const Proof proof = badges_->of_writer(writer);
  const Standing standing = judge(writer, claim);
  const std::string machine =
      standing == Standing::not_its_machine ? std::string(claim.machine) : "";
  const std::string who = proof.badge
                              ? proof.badge->name
                              : fmt::format("participant {}", badges_->name_of_writer(writer));
  const std::string doubt = doubt_of(proof, standing, claim.machine);
  badges_->complain(fmt::format("{}/{}/{}", who, machine, topic),
                    fmt::format("{}{}: what it says on {} is not listened to", doubt,
                                proof.badge ? "" : fmt::format(" ({})", who), topic));
}

std::uint64_t Witness::asker_of(dds_instance_handle_t writer, std::string_view machine) const {
  if (badges_ == nullptr) {
    return writer;
  }
  const Proof proof = badges_->of_writer(writer);
  const bool speaks_for_it = speaks_for(writer, machine);
  constexpr std::uint64_t gateways = 1;
  return speaks_for_it || !proof.badge ? gateways
                                       : std::hash<std::string>{}(proof.badge->name) | 2U;
}

std::string Witness::certificate_of(dds_instance_handle_t writer) const {
  if (badges_ == nullptr) {
    return {};
  }
  const Proof proof = badges_->of_writer(writer);
  return proof.badge ? proof.badge->name : std::string();
}

void apply_certificate(Command& value, const Witness& witness, dds_instance_handle_t writer) {
  value.issuer = issuer_of(witness.certificate_of(writer), value.issuer);
}

void apply_certificate(Notice& value, const Witness& witness, dds_instance_handle_t writer) {
  value.program = issuer_of(witness.certificate_of(writer), value.program);
}

void apply_certificate(VariableRequest& value, const Witness& witness,
                       dds_instance_handle_t writer) {
  value.issuer = issuer_of(witness.certificate_of(writer), value.issuer);
}

}  // namespace millrace::fabric::wire
