// All participants of a DDS domain, of any fabric, and their endpoints on the topics of millrace,
// from discovery.
//
//   Directory directory(participant);
//   directory.drain();
//   for (const auto& [handle, endpoint] : directory.endpoints()) …
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/doctor/announcement.hpp"
#include "tools/doctor/qos.hpp"

namespace millrace::tools::doctor {

/// Cyclone's instance handle of a discovered participant or endpoint.
using Handle = dds_instance_handle_t;

struct SeenParticipant {
  /// Host and process only from Cyclone; with trust those of its identity.
  Announcement who{};
  /// "10.77.0.3", …: its addresses, in Cyclone's form.
  std::string addresses{};
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
