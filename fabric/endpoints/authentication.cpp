#include "fabric/endpoints/authentication.hpp"

#include <set>

#include "fabric/dds/entity.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::endpoints {

namespace {

/// Hands each sample that a built-in topic has now to `use`.
template <typename Sample, typename Use>
void for_each(const dds::Participant& participant, dds_entity_t topic, const Use& use) {
  const dds::Entity reader(
      dds::check(dds_create_reader(participant.handle(), topic, nullptr, nullptr),
                 "read the participants of DDS"));
  while (wire::take_lent<Sample>(reader.handle(), use) > 0) {
  }
}

}  // namespace

std::size_t count_unauthenticated(const dds::Participant& participant) {
  if (participant.authenticator() == nullptr) {
    return 0;
  }
  std::set<dds_instance_handle_t> waiting;
  for_each<dds_builtintopic_participant_t>(
      participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT,
      [&](const dds_builtintopic_participant_t& /*sample*/, const dds_sample_info_t& info) {
        if (info.valid_data && wire::instance_state_of(info) == wire::InstanceState::alive) {
          waiting.insert(info.instance_handle);
        }
      });
  for_each<dds_builtintopic_endpoint_t>(
      participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION,
      [&](const dds_builtintopic_endpoint_t& sample, const dds_sample_info_t& info) {
        if (info.valid_data) {
          waiting.erase(sample.participant_instance_handle);
        }
      });
  return waiting.size();
}

}  // namespace millrace::fabric::endpoints
