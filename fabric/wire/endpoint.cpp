#include "fabric/wire/endpoint.hpp"

#include <algorithm>
#include <mutex>

#include <dds/version.h>
#include <fmt/format.h>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/made_id.hpp"
#include "fabric/wire/key_limit.hpp"

namespace millrace::fabric::wire {

dds::Qos writer_qos(const Topic& topic, const EndpointOptions& options) {
  dds::Qos qos = writer_qos(topic, options.user_data);
  if (options.lease) {
    dds_qset_liveliness(qos.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC,
                        DDS_MSECS(options.lease->count()));
  }
  return qos;
}

dds::Qos reader_qos(const Topic& topic, Keep keep, const EndpointOptions& options) {
  dds::Qos qos = reader_qos(topic, keep, options.user_data);
  if (options.others_only) {
    dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  }
  return qos;
}

dds::Entity create_topic(const dds::Participant& participant, const Topic& topic) {
  return dds::Entity(
      dds::check(dds_create_topic(participant.handle(), topic.type, topic.name, nullptr, nullptr),
                 fmt::format("create the topic {}", topic.name)));
}

dds::Entity create_publisher(const dds::Participant& participant, const std::string& partition) {
  return dds::Entity(dds::check(
      dds_create_publisher(participant.handle(), partition_qos(partition).get(), nullptr),
      fmt::format("publish in {}", partition)));
}

dds::Entity create_subscriber(const dds::Participant& participant, const std::string& partition) {
  return dds::Entity(dds::check(
      dds_create_subscriber(participant.handle(), partition_qos(partition).get(), nullptr),
      fmt::format("subscribe to {}", partition)));
}

dds::Listener reader_listener(const dds::Participant& participant, const EndpointOptions& options,
                              KeyLimit* limit) {
  dds::Listener listener(dds_create_listener(nullptr));
  if (options.listener != nullptr) {
    dds_copy_listener(listener.get(), options.listener);
  }
  dds_on_subscription_matched_fn taken = nullptr;
  dds_lget_subscription_matched(listener.get(), &taken);
  // An endpoint with its own match listener authenticates by itself.
  if (participant.authenticator() != nullptr && taken == nullptr) {
    participant.authenticator()->listen(listener.get());
  } else if (limit != nullptr && taken == nullptr) {
    limit->listen(listener.get());
  }
  return listener;
}

dds_entity_t create_writer(const dds::Entity& publisher, const dds::Entity& topic,
                           const dds::Qos& qos, const EndpointOptions& options,
                           const std::string& what) {
#if DDS_VERSION_MAJOR > 0 || DDS_VERSION_MINOR > 10 || DDS_VERSION_PATCH >= 5
  const dds::Qos with_batching(dds_create_qos());
  dds_copy_qos(with_batching.get(), qos.get());
  dds_qset_writer_batching(with_batching.get(), options.batched);
  const dds_entity_t writer =
      dds_create_writer(publisher.handle(), topic.handle(), with_batching.get(), options.listener);
#else
  // Cyclone 0.10.2 has one switch for the process. A writer takes it over when it is created;
  // throwing it later changes the writers of participants only, and ours belong to publishers.
  static std::mutex the_switch;
  const std::lock_guard guard(the_switch);
  dds_write_set_batch(options.batched);
  const dds_entity_t writer =
      dds_create_writer(publisher.handle(), topic.handle(), qos.get(), options.listener);
  dds_write_set_batch(false);
#endif
  return dds::check(writer, what);
}

std::string program_of(dds_entity_t reader, dds_instance_handle_t writer) {
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, writer);
  if (endpoint == nullptr) {
    return {};
  }
  std::string name = dds::guid_prefix(endpoint->participant_key);
  dds_builtintopic_free_endpoint(endpoint);
  return name;
}

bool made_id(dds_entity_t reader, dds_instance_handle_t writer, const InstanceId& id) {
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, writer);
  if (endpoint == nullptr) {
    return false;
  }
  const bool made = dds::is_made_by(id, endpoint->participant_key);
  dds_builtintopic_free_endpoint(endpoint);
  return made;
}

dds_instance_handle_t participant_of(dds_entity_t reader, dds_instance_handle_t writer) {
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, writer);
  if (endpoint == nullptr) {
    return DDS_HANDLE_NIL;
  }
  const dds_instance_handle_t participant = endpoint->participant_instance_handle;
  dds_builtintopic_free_endpoint(endpoint);
  return participant;
}

std::vector<dds_instance_handle_t> matched_endpoints(dds_entity_t endpoint, AskMatched ask) {
  std::vector<dds_instance_handle_t> handles(8);
  for (;;) {
    const auto count =
        static_cast<std::size_t>(std::max(ask(endpoint, handles.data(), handles.size()), 0));
    const bool complete = count <= handles.size();
    handles.resize(count);
    if (complete) {
      return handles;
    }
  }
}

}  // namespace millrace::fabric::wire
