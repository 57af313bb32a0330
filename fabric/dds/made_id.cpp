#include "fabric/dds/made_id.hpp"

#include <algorithm>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/participant.hpp"

namespace millrace::fabric::dds {

namespace {

/// The part of a GUID that a certificate decides. Ten further bytes of an id are random.
constexpr std::size_t of_certificate = 6;

}  // namespace

InstanceId make_id(const Participant& participant) {
  dds_guid_t guid{};
  check(dds_get_guid(participant.handle(), &guid), "read the GUID of the participant");
  InstanceId id = InstanceId::random();
  std::copy_n(std::begin(guid.v), of_certificate, id.bytes.begin());
  return id;
}

bool is_made_by(const InstanceId& id, const dds_guid_t& participant) {
  return std::equal(id.bytes.begin(), id.bytes.begin() + of_certificate, std::begin(participant.v));
}

}  // namespace millrace::fabric::dds
