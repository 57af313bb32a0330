#include "fabric/trust/grants.hpp"

#include <algorithm>
#include <initializer_list>

#include "fabric/messages.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::fabric::trust {

namespace {

using wire::Topic;

/// Topics in the partition of the fabric itself, which every full observer reads.
const std::initializer_list<const Topic*> spoken{
    &wire::heartbeat_topic, &wire::channel_topic,         &wire::machine_topic, &wire::event_topic,
    &wire::command_topic,   &wire::outcome_topic,         &wire::alarm_topic,   &wire::data_topic,
    &wire::program_topic,   &wire::variable_request_topic};

class Grants {
 public:
  explicit Grants(std::string_view fabric) : fabric_(fabric), calls_(wire::all_services(fabric)) {}

  void of(Role role, const Participant& participant) {
    switch (role) {
      case Role::gateway:
        write({&wire::channel_topic, &wire::machine_topic, &wire::event_topic, &wire::outcome_topic,
               &wire::alarm_topic, &wire::data_topic, &wire::program_topic},
              fabric_);
        write({&wire::request_topic}, calls_);
        // To each requester of variables, in its own partition.
        write({&wire::variable_reply_topic}, calls_);
        see_everything();
        break;
      case Role::service:
        answer(participant);
        break;
      case Role::operating:
        // A requester that only reads variables also writes requests.
        write({&wire::command_topic, &wire::variable_request_topic}, fabric_);
        see_everything();
        break;
      case Role::observer:
        // The alarms of a recorder.
        write({&wire::alarm_topic}, fabric_);
        see_everything();
        break;
      case Role::tester:
        // What a replay publishes too: of machines that no gateway serves.
        write({&wire::event_topic, &wire::data_topic, &wire::program_topic}, fabric_);
        write({&wire::request_topic}, calls_);
        see_everything();
        break;
    }
  }

  /// Its own identity, readable for all, and those of the others.
  void add_identity(const Participant& participant) {
    ParticipantIdentity identity{.name = participant.name};
    for (const Role role : participant.roles) {
      identity.roles.emplace(name_of(role));
    }
    identity.machines.insert(participant.machines.begin(), participant.machines.end());
    for (const std::string& partition : identity_partitions(fabric_, identity)) {
      grants_.push_back({Access::write, identity_topic_name, partition});
    }
    grants_.push_back({Access::read, identity_topic_name, identity_readers_partition(fabric_)});
  }

  std::vector<Grant> take() {
    std::ranges::sort(grants_);
    const auto twice = std::ranges::unique(grants_);
    grants_.erase(twice.begin(), twice.end());
    return std::move(grants_);
  }

 private:
  void write(std::initializer_list<const Topic*> topics, const std::string& partition) {
    add(Access::write, topics, partition);
  }
  void read(std::initializer_list<const Topic*> topics, const std::string& partition) {
    add(Access::read, topics, partition);
  }
  void add(Access access, std::initializer_list<const Topic*> topics,
           const std::string& partition) {
    for (const Topic* topic : topics) {
      grants_.push_back({access, topic->name, partition});
    }
  }

  void see_everything() {
    read(spoken, fabric_);
    read({&wire::request_topic, &wire::reply_topic, &wire::variable_reply_topic}, calls_);
  }

  void answer(const Participant& participant) {
    // The writing participant decides whose heartbeat and outcome it is.
    write({&wire::heartbeat_topic, &wire::outcome_topic, &wire::alarm_topic}, fabric_);
    read({&wire::command_topic}, fabric_);
    for (const std::string& uuid : participant.uuids) {
      const std::string own = wire::service_partition(fabric_, canonical_uuid(uuid));
      write({&wire::reply_topic}, own);
      read({&wire::request_topic}, own + "/*");
    }
  }

  std::string fabric_;
  std::string calls_;
  std::vector<Grant> grants_;
};

}  // namespace

std::vector<Grant> grants_of(const Participant& participant, std::string_view fabric) {
  Grants grants(fabric);
  for (const Role role : participant.roles) {
    grants.of(role, participant);
  }
  grants.add_identity(participant);
  return grants.take();
}

}  // namespace millrace::fabric::trust
