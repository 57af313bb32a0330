// All participants of a DDS domain, of any fabric, and their endpoints on the topics of millrace,
// from discovery.
//
//   Directory directory(participant);
//   directory.drain();
//   for (const auto& [handle, endpoint] : directory.endpoints()) …
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <dds/dds.h>

#include "base/messages/message.hpp"
#include "fabric/dds/entity.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/process_version.hpp"
#include "tools/doctor/announcement.hpp"

namespace millrace::tools::doctor {

// Whether a writer and a reader of one topic match: the QoS that DDS compares (OMG DDS 1.4, 2.2.3,
// "request versus offered"). Pure except for the conversion.

/// Durations in nanoseconds; the kinds in the order of the standard, a later one offering more.
struct EndpointQos {
  bool reliable = false;
  std::uint32_t durability = DDS_DURABILITY_VOLATILE;
  std::int64_t deadline = DDS_INFINITY;
  std::int64_t latency_budget = 0;
  bool exclusive = false;
  std::uint32_t liveliness = DDS_LIVELINESS_AUTOMATIC;
  std::int64_t lease = DDS_INFINITY;
  bool by_source_time = false;
};

/// Unset policies have the standard's default for this side.
EndpointQos qos_of(const dds_qos_t& qos, bool of_writer);

/// "reliability: best effort is offered, reliable is requested", … ; empty if they fit.
std::vector<base::messages::Message> misfits(const EndpointQos& offered,
                                             const EndpointQos& requested);

/// Cyclone's instance handle of a discovered participant or endpoint.
using Handle = dds_instance_handle_t;

struct SeenParticipant {
  /// Host and process only from Cyclone; with trust those of its identity.
  Announcement who{};
  /// "10.77.0.3", …: its addresses, in Cyclone's form.
  std::string addresses{};
  /// As announced.
  std::optional<fabric::ProcessVersion> version{};
  bool self = false;
};

struct SeenEndpoint {
  Handle participant = 0;
  bool writer = false;
  std::string topic{};
  std::string type{};
  std::vector<std::string> partitions{};
  std::string user_data{};
  EndpointQos qos{};
};

class Directory {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit Directory(const fabric::dds::Participant& participant);

  /// Takes the news of discovery.
  void drain();

  [[nodiscard]] const std::map<Handle, SeenParticipant>& participants() const {
    return participants_;
  }
  [[nodiscard]] const std::map<Handle, SeenEndpoint>& endpoints() const { return endpoints_; }

 private:
  void drain_participants();
  void drain_endpoints(dds_entity_t reader, bool writers);

  dds_guid_t own_{};
  fabric::dds::Entity participant_reader_;
  fabric::dds::Entity subscriptions_;
  fabric::dds::Entity publications_;
  std::map<Handle, SeenParticipant> participants_;
  std::map<Handle, SeenEndpoint> endpoints_;
};

}  // namespace millrace::tools::doctor
