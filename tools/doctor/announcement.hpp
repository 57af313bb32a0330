// The multicast announcement of a DDS participant: one RTPS packet with its SPDP data (OMG
// DDSI-RTPS 2.2, 8.5.3 and 9.6.2.2; its identity token: OMG DDS Security 1.1, 7.4.1.4 and 9.3.2.1).
// Pure; reads foreign bytes.
//
//   auto who = parse_announcement(packet);
//   who->host, who->process
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace millrace::tools::doctor {

/// The first 12 bytes of the GUIDs of a participant and all its endpoints.
using GuidPrefix = std::array<std::uint8_t, 12>;

struct Announcement {
  GuidPrefix prefix{};
  /// The entity name of the participant, for ours that of the program; empty if it gives none.
  std::string name{};
  /// Additions of Cyclone; other vendors may not have them.
  std::string host{};
  std::string process{};
  std::string pid{};
  /// It has a certificate, which was not checked yet.
  bool shows_certificate = false;
  /// The subjects of its certificate and CA ("CN=square-root"), if announced; Cyclone does not
  /// announce them.
  std::string certificate{};
  std::string authority{};
};

/// Nothing if the packet is not RTPS, or holds no such data.
std::optional<Announcement> parse_announcement(std::span<const std::uint8_t> packet);

}  // namespace millrace::tools::doctor
