// A Fast DDS participant on the loopback interface, and the endpoints of docs/reference/wire.md on
// it.
#pragma once

#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

namespace millrace::tests::interop::fastdds {

namespace dds = eprosima::fastdds::dds;

/// The properties of an endpoint other than its topic.
struct EndpointOptions {
  std::string partition;
  /// For a writer in several partitions.
  std::vector<std::string> more_partitions{};
  std::string user_data{};
  bool best_effort = false;
  /// The number of keys it may know at once; 0 = no limit.
  int max_instances = 0;
};

/// RAII: its endpoints are destroyed with it. For one thread.
class Fabric {
 public:
  struct Options {
    std::uint32_t domain = 0;
    std::string name = "millrace";
    /// Of the participant.
    int lease_seconds = 20;
    /// The folder from `millrace trust issue`; empty without trust. SIGN, unless `encrypt`.
    std::string trust{};
    bool encrypt = false;
    dds::DomainParticipantListener* listener = nullptr;
  };

  /// Throws std::runtime_error if the domain cannot be joined.
  explicit Fabric(const Options& options);
  ~Fabric();
  Fabric(const Fabric&) = delete;
  Fabric& operator=(const Fabric&) = delete;

  [[nodiscard]] const std::string& name() const { return options_.name; }

  /// Reliable, transient local, keep last 1; or best effort and volatile, if the options ask for
  /// it.
  dds::DataReader* read(const std::string& topic, const dds::TypeSupport& type,
                        const EndpointOptions& options, dds::DataReaderListener* listener);
  dds::DataWriter* write(const std::string& topic, const dds::TypeSupport& type,
                         const EndpointOptions& options,
                         dds::DataWriterListener* listener = nullptr);
  /// Changes the identity of an endpoint.
  static void set_user_data(dds::DataReader& reader, const std::string& text);

 private:
  dds::Topic* topic(const std::string& name, const dds::TypeSupport& type);

  const Options options_;
  dds::DomainParticipant* participant_ = nullptr;
};

}  // namespace millrace::tests::interop::fastdds
