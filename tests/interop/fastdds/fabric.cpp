#include "fabric.hpp"

#include <memory>
#include <stdexcept>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/PublisherQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

namespace millrace::tests::interop::fastdds {

namespace {

template <typename Made>
Made* made(Made* made, const std::string& what) {
  if (made == nullptr) {
    throw std::runtime_error("Fast DDS does not make " + what);
  }
  return made;
}

template <typename Qos>
void set_user_data_of(Qos& qos, const std::string& text) {
  qos.user_data().setValue(std::vector<eprosima::fastrtps::rtps::octet>(text.begin(), text.end()));
}

/// The common settings of both sides of a topic.
template <typename Qos>
void set_common(Qos& qos, const EndpointOptions& options) {
  qos.reliability().kind =
      options.best_effort ? dds::BEST_EFFORT_RELIABILITY_QOS : dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind =
      options.best_effort ? dds::VOLATILE_DURABILITY_QOS : dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  qos.resource_limits().max_instances = options.max_instances;
  qos.resource_limits().max_samples = 0;
  qos.resource_limits().max_samples_per_instance = 1;
  // Fast DDS's shared memory, which Cyclone does not support.
  qos.data_sharing().off();
  if (!options.user_data.empty()) {
    set_user_data_of(qos, options.user_data);
  }
}

/// Gives Fast DDS the credentials in a participant's folder.
void show(dds::DomainParticipantQos& qos, const std::string& folder, bool encrypt) {
  auto& properties = qos.properties().properties();
  const auto add = [&](const std::string& name, const std::string& value) {
    properties.emplace_back(name, value);
  };
  const auto add_file = [&](const std::string& name, const std::string& file) {
    add(name, "file://" + folder + "/" + file);
  };
  add("dds.sec.auth.plugin", "builtin.PKI-DH");
  add_file("dds.sec.auth.builtin.PKI-DH.identity_ca", "identity_authority.pem");
  add_file("dds.sec.auth.builtin.PKI-DH.identity_certificate", "certificate.pem");
  add_file("dds.sec.auth.builtin.PKI-DH.identity_crl", "revoked.pem");
  add_file("dds.sec.auth.builtin.PKI-DH.private_key", "key.pem");
  add("dds.sec.access.plugin", "builtin.Access-Permissions");
  add_file("dds.sec.access.builtin.Access-Permissions.permissions_ca", "permissions_authority.pem");
  add_file("dds.sec.access.builtin.Access-Permissions.governance",
           encrypt ? "governance_encrypt.p7s" : "governance_sign.p7s");
  add_file("dds.sec.access.builtin.Access-Permissions.permissions", "permissions.p7s");
  add("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
}

}  // namespace

Fabric::Fabric(const Options& options) : options_(options) {
  dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
  // Only UDP on the loopback interface; the built-in transports would use every interface, and
  // shared memory.
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = {options_.lease_seconds, 0};
  discovery.leaseDuration_announcementperiod = {options_.lease_seconds / 4, 0};
  if (!options_.trust.empty()) {
    show(qos, options_.trust, options_.encrypt);
  }
  participant_ = made(dds::DomainParticipantFactory::get_instance()->create_participant(
                          options_.domain, qos, options_.listener, dds::StatusMask::none()),
                      "a participant");
}

Fabric::~Fabric() {
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

dds::Topic* Fabric::topic(const std::string& name, const dds::TypeSupport& type) {
  type.register_type(participant_);
  if (dds::TopicDescription* known = participant_->lookup_topicdescription(name)) {
    return dynamic_cast<dds::Topic*>(known);
  }
  return made(participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT),
              "topic " + name);
}

dds::DataReader* Fabric::read(const std::string& topic_name, const dds::TypeSupport& type,
                              const EndpointOptions& options, dds::DataReaderListener* listener) {
  dds::SubscriberQos subscriber = dds::SUBSCRIBER_QOS_DEFAULT;
  subscriber.partition().push_back(options.partition.c_str());
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  set_common(qos, options);
  dds::Topic* const on = topic(topic_name, type);
  return made(made(participant_->create_subscriber(subscriber), "a subscriber")
                  ->create_datareader(on, qos, listener),
              "a reader of " + topic_name);
}

dds::DataWriter* Fabric::write(const std::string& topic_name, const dds::TypeSupport& type,
                               const EndpointOptions& options, dds::DataWriterListener* listener) {
  dds::PublisherQos publisher = dds::PUBLISHER_QOS_DEFAULT;
  publisher.partition().push_back(options.partition.c_str());
  for (const std::string& partition : options.more_partitions) {
    publisher.partition().push_back(partition.c_str());
  }
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  set_common(qos, options);
  // A loss is detected by the next heartbeat; Fast DDS's default is one every 3 s.
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, 100'000'000};
  qos.writer_data_lifecycle().autodispose_unregistered_instances = false;
  dds::Topic* const on = topic(topic_name, type);
  return made(made(participant_->create_publisher(publisher), "a publisher")
                  ->create_datawriter(on, qos, listener),
              "a writer of " + topic_name);
}

void Fabric::set_user_data(dds::DataReader& reader, const std::string& text) {
  dds::DataReaderQos qos = reader.get_qos();
  set_user_data_of(qos, text);
  reader.set_qos(qos);
}

}  // namespace millrace::tests::interop::fastdds

#ifdef __SANITIZE_ADDRESS__
/// Fast DDS 2.9 deletes its readers through a smaller type.
extern "C" const char* __asan_default_options() {
  return "new_delete_type_mismatch=0";
}
#endif
