// The topics of a fabric in one place: names, keys (see idl/millrace.idl), QoS and partitions.
//
//   millrace/v5/request  gateway to one instance             partition FABRIC/UUID/INSTANCE
//   millrace/v5/reply    instance to gateway                 partition FABRIC/UUID
//   millrace/v5/heartbeat     process of instances to gateways    partition FABRIC
//   millrace/v5/channel     gateway to tools                    partition FABRIC
//   millrace/v5/machine     gateway to gateways and tools       partition FABRIC
//   millrace/v5/event       gateway to recorder and tools       partition FABRIC
//   millrace/v5/command     tools to gateways and instances     partition FABRIC
//   millrace/v5/outcome     gateway or instance to tools        partition FABRIC
//   millrace/v5/alarm      any program to tools                partition FABRIC
//   millrace/v5/data        gateway to tools                    partition FABRIC
//   millrace/v5/program     gateway to tools                    partition FABRIC
//   millrace/v5/variable/request   tools to gateways            partition FABRIC
//   millrace/v5/variable/reply     gateway to one requester         partition FABRIC/ASKER
// Those of variables have no key. Requests are volatile: a requester repeats its request until it
// is answered. The last reply stays for a requester that the gateway discovers later.
// fabric/trust/permissions.hpp has the permissions with trust.
//
// All have the version of the wire in their name, so that two versions never misread each other. A
// version adds to a sample's `extras` and new values of its codes; neither changes the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "fabric/dds/entity.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric::wire {

/// What distinguishes a topic from the others.
struct Topic {
  const char* name = nullptr;
  const dds_topic_descriptor_t* type = nullptr;
  /// The last sample of each key waits for readers that join later.
  bool transient_local = false;
  /// Samples of a key that a writer keeps for readers that have not acknowledged them. It
  /// overwrites older ones; a writer that kept all would wait for its slowest reader.
  std::int32_t writer_depth = 1;
  /// A lost sample is soon followed by the next one.
  bool best_effort = false;
  /// Largest number of keys that a reader keeps of each writer; it drops samples of further keys
  /// before anything is stored. Far more than a plant has, and no more memory than a stranger may
  /// cost. 0: the topic has no key.
  std::size_t most_keys = 0;
};

extern const Topic request_topic;
extern const Topic reply_topic;
extern const Topic channel_topic;
extern const Topic heartbeat_topic;
extern const Topic machine_topic;
extern const Topic event_topic;
extern const Topic command_topic;
extern const Topic outcome_topic;
extern const Topic alarm_topic;
extern const Topic data_topic;
extern const Topic program_topic;
extern const Topic variable_request_topic;
extern const Topic variable_reply_topic;

/// How much a reader keeps. Reliability and durability come from the topic.
enum class Keep {
  /// The newest samples of each key, at most 32.
  last,
  /// Everything until it is taken; for a recorder that reads in its own thread.
  all
};

/// The QoS of a writer: reliable, but it never waits for a slow reader.
dds::Qos writer_qos(const Topic& topic, std::string_view user_data = {});
dds::Qos reader_qos(const Topic& topic, Keep keep, std::string_view user_data = {});
/// Of a publisher or subscriber.
dds::Qos partition_qos(const std::string& partition);

/// The fabric of a partition: "millrace" of "millrace", "millrace/560aacbf-…" and "millrace/*".
std::string fabric_of(std::string_view partition);
/// "millrace/560aacbf-…": the partition of the replies of a UUID's instances.
std::string service_partition(std::string_view fabric, std::string_view canonical_uuid);
/// "millrace/560aacbf-…/8d0c4e6a-…": the partition of one instance's requests.
std::string request_partition(std::string_view fabric, std::string_view canonical_uuid,
                              const InstanceId& instance);
/// "millrace/8d0c4e6a-…": the partition of the replies to one requester.
std::string requester_partition(std::string_view fabric, const InstanceId& requester);
/// "millrace/*": all UUIDs and partitions of a fabric, for a reader.
std::string all_services(std::string_view fabric);

struct RequestPartition {
  std::string uuid;
  InstanceId instance;
};
/// The parts of a request partition of this fabric; nullopt for patterns and other partitions.
std::optional<RequestPartition> parse_request_partition(std::string_view fabric,
                                                        std::string_view partition);

}  // namespace millrace::fabric::wire
