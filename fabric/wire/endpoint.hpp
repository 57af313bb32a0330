// The common parts of readers and writers.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::fabric::wire {

struct EndpointOptions {
  /// The user_data of the endpoint in discovery.
  std::string user_data{};
  /// Not owned; Cyclone copies it.
  const dds_listener_t* listener = nullptr;
  /// A reader that ignores the writers of its own participant.
  bool others_only = false;
  /// A reader that also returns unauthorized samples, marked as such (Taken::authorization).
  bool deliver_unauthorized = false;
  /// A writer whose samples wait until Writer::flush, or until a datagram is full.
  bool batched = false;
  /// A writer that counts as gone, although its process runs, when it has neither written nor
  /// asserted itself for this time (Writer::assert_itself). Without it, it lives as long as its
  /// process.
  std::optional<std::chrono::milliseconds> lease{};
};

/// The QoS that a writer with these options offers.
dds::Qos writer_qos(const Topic& topic, const EndpointOptions& options);
/// The QoS that a reader with these options requests.
dds::Qos reader_qos(const Topic& topic, Keep keep, const EndpointOptions& options);

/// The DDS topic of one endpoint; throws std::runtime_error.
dds::Entity create_topic(const dds::Participant& participant, const Topic& topic);
/// A publisher in `partition`; throws std::runtime_error.
dds::Entity create_publisher(const dds::Participant& participant, const std::string& partition);
/// A subscriber of `partition`, which may be a pattern; throws std::runtime_error.
dds::Entity create_subscriber(const dds::Participant& participant, const std::string& partition);

class KeyLimit;

/// The listener of a reader, which with trust also stores the participants of matched writers, and
/// otherwise their names for `limit`, if that is not null.
dds::Listener reader_listener(const dds::Participant& participant, const EndpointOptions& options,
                              KeyLimit* limit = nullptr);

/// A writer; throws std::runtime_error with `what`.
dds_entity_t create_writer(const dds::Entity& publisher, const dds::Entity& topic,
                           const dds::Qos& qos, const EndpointOptions& options,
                           const std::string& what);

using AskMatched = dds_return_t (*)(dds_entity_t, dds_instance_handle_t*, std::size_t);

/// The DDS name of this writer's participant, which is matched with `reader`: the prefix of its
/// GUID. Empty if it is gone.
std::string program_of(dds_entity_t reader, dds_instance_handle_t writer);

/// Whether the participant of this writer made the id (fabric/dds/made_id.hpp).
bool made_id(dds_entity_t reader, dds_instance_handle_t writer, const InstanceId& id);

/// The participant as in samples of DCPSParticipant; nil if it is gone.
dds_instance_handle_t participant_of(dds_entity_t reader, dds_instance_handle_t writer);

/// The handles that `ask` (dds_get_matched_subscriptions or _publications) gives for `endpoint`.
std::vector<dds_instance_handle_t> matched_endpoints(dds_entity_t endpoint, AskMatched ask);

}  // namespace millrace::fabric::wire
