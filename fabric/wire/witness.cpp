#include "fabric/wire/witness.hpp"

#include <fmt/format.h>

#include "fabric/command.hpp"
#include "fabric/variables.hpp"

namespace millrace::fabric::wire {

Standing Witness::judge(dds_instance_handle_t writer, const Claim& claim, bool news) const {
  const Proof proof = badges_->of_writer(writer);
  const Standing standing = standing_of(proof, claim.machine, claim.testers);
  return news && standing == Standing::unproven ? Standing::believed : standing;
}

void Witness::complain(dds_instance_handle_t writer, const Claim& claim, const char* topic) const {
  const Proof proof = badges_->of_writer(writer);
  const Standing standing = standing_of(proof, claim.machine, claim.testers);
  const std::string machine =
      standing == Standing::not_its_machine ? std::string(claim.machine) : "";
  badges_->complain(fmt::format("{}/{}/{}", proof.badge ? proof.badge->name : "", machine, topic),
                    fmt::format("{}: what it says on {} is not listened to",
                                doubt_of(proof, standing, claim.machine), topic));
}

std::string Witness::certificate_of(dds_instance_handle_t writer) const {
  if (badges_ == nullptr) {
    return {};
  }
  const Proof proof = badges_->of_writer(writer);
  return proof.badge ? proof.badge->name : std::string();
}

void name_issuer(Command& value, const Witness& witness, dds_instance_handle_t writer) {
  value.issuer = issuer_of(witness.certificate_of(writer), value.issuer);
}

void name_issuer(VariableRequest& value, const Witness& witness, dds_instance_handle_t writer) {
  value.issuer = issuer_of(witness.certificate_of(writer), value.issuer);
}

}  // namespace millrace::fabric::wire
