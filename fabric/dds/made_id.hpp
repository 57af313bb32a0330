// Ids that name their maker: with DDS Security the first six bytes of a participant's GUID are a
// hash of the subject of its certificate (DDS Security 1.1, 9.3.3), which Cyclone checks. So a
// process can announce the id of another certificate's process, but not as the one that made it.
//
//   const InstanceId id = make_id(participant);
//   is_made_by(id, endpoint.participant_key)   // of a sample of a built-in topic
#pragma once

#include <dds/dds.h>

#include "fabric/messages.hpp"

namespace millrace::fabric::dds {

class Participant;

/// A new id, different from all others.
InstanceId make_id(const Participant& participant);

/// Whether a participant with this GUID, or one of the same certificate, made the id. Ids of other
/// vendors' programs have no maker.
bool is_made_by(const InstanceId& id, const dds_guid_t& participant);

}  // namespace millrace::fabric::dds
