#include "fabric/profile/profile.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "idl/fabric.pb.h"

namespace millrace::fabric::profile {

namespace {

/// The highest domain whose ports exist.
constexpr std::uint32_t max_domain = 232;
/// Enough for a host's services, and few enough for packet filters and for searching peers.
constexpr std::uint32_t default_processes = 20;
constexpr std::uint32_t max_processes = 100;
constexpr std::uint32_t min_lease_ms = 100;
constexpr std::uint32_t max_lease_ms = 100'000;
/// Room for a name and its terminating NUL in the kernel (IFNAMSIZ).
constexpr std::size_t max_interface_length = 15;

bool is_address(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool consists_of(const std::string& text, std::string_view more) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           more.find(c) != std::string_view::npos;
  });
}

bool is_interface(const std::string& text) {
  return is_address(text) || (consists_of(text, "_.-@") && text.size() <= max_interface_length);
}

bool is_loopback(const std::string& interface) {
  return interface == "lo" || interface.starts_with("127.");
}

/// Collects what is wrong with a profile, each with its place in the file.
class Check {
 public:
  Check(const config::Fabric& profile, const base::configuration::ConfigPlaces& places)
      : profile_(profile), places_(places) {}

  void expect(bool right, const std::string& field, const std::string& what, int index = 0) {
    if (!right) {
      mistakes_.push_back(
          fmt::format("{}: {}: {}", places_.at(profile_, {{field, index}}), field, what));
    }
  }

  [[nodiscard]] std::string text() const { return fmt::format("{}", fmt::join(mistakes_, "\n")); }

 private:
  const config::Fabric& profile_;
  const base::configuration::ConfigPlaces& places_;
  std::vector<std::string> mistakes_;
};

void check_numbers(const config::Fabric& profile, Check& check) {
  check.expect(profile.domain() <= max_domain, "domain",
               fmt::format("{}; expected 0 to {}", profile.domain(), max_domain));
  const std::uint32_t processes = profile.processes_per_host();
  check.expect(!profile.has_processes_per_host() || (processes >= 1 && processes <= max_processes),
               "processes_per_host", fmt::format("{}; expected 1 to {}", processes, max_processes));
  const std::uint32_t lease = profile.lease_ms();
  check.expect(lease >= min_lease_ms && lease <= max_lease_ms, "lease_ms",
               fmt::format("{}; expected {} to {}", lease, min_lease_ms, max_lease_ms));
}

std::string mistakes_of(const config::Fabric& profile,
                        const base::configuration::ConfigPlaces& places) {
  Check check(profile, places);
  check.expect(
      dds::is_fabric_name(profile.fabric()), "fabric",
      fmt::format("\"{}\"; expected some text without '*', '?', '/' and ','", profile.fabric()));
  check_numbers(profile, check);
  check.expect(is_interface(profile.interface()), "interface",
               fmt::format("\"{}\"; expected the name of a network interface, as `ip link` shows "
                           "it, or its IPv4 address",
                           profile.interface()));
  for (int i = 0; i < profile.peers_size(); ++i) {
    check.expect(consists_of(profile.peers(i), ".-"), "peers",
                 fmt::format("\"{}\"; expected a host's name or IPv4 address", profile.peers(i)),
                 i);
  }
  return check.text();
}

std::string interface_element(const std::string& interface) {
  return fmt::format(R"(<Interfaces><NetworkInterface {}="{}"{}/></Interfaces>)",
                     is_address(interface) ? "address" : "name", interface,
                     // Linux's loopback does multicast although its flag says no.
                     is_loopback(interface) ? R"( multicast="true")" : "");
}

std::string peers_element(const config::Fabric& profile) {
  std::string peers;
  for (const std::string& peer : profile.peers()) {
    peers += fmt::format(R"(<Peer Address="{}"/>)", peer);
  }
  if (!profile.multicast()) {
    // Without multicast the other programs of this host are found in this way only.
    peers += R"(<Peer Address="127.0.0.1"/>)";
  }
  return peers.empty() ? peers : fmt::format("<Peers>{}</Peers>", peers);
}

std::string ports_element(const config::Fabric& profile) {
  const bool wanted = profile.has_processes_per_host() || profile.peers_size() > 0;
  if (!wanted && profile.multicast()) {
    return "<ParticipantIndex>none</ParticipantIndex>";
  }
  const std::uint32_t processes =
      profile.has_processes_per_host() ? profile.processes_per_host() : default_processes;
  // Cyclone 0.10 neither gives out nor searches the index that it calls the maximum.
  return fmt::format(
      "<ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>",
      processes);
}

}  // namespace

std::string cyclone_configuration(const config::Fabric& profile) {
  return fmt::format(
      "<General>{}<AllowMulticast>{}</AllowMulticast></General><Discovery>{}{}</Discovery>",
      interface_element(profile.interface()), profile.multicast() ? "spdp" : "false",
      ports_element(profile), peers_element(profile));
}

tl::expected<dds::ParticipantOptions, std::string> read_profile(const std::filesystem::path& file) {
  config::Fabric profile;
  base::configuration::ConfigPlaces places;
  if (const auto done = base::configuration::read_config(file, profile, places); !done) {
    return tl::unexpected(done.error());
  }
  if (std::string mistakes = mistakes_of(profile, places); !mistakes.empty()) {
    return tl::unexpected(std::move(mistakes));
  }
  return dds::ParticipantOptions{.domain = profile.domain(),
                                 .fabric = profile.fabric(),
                                 .lease = std::chrono::milliseconds(profile.lease_ms()),
                                 .configuration = cyclone_configuration(profile)};
}

}  // namespace millrace::fabric::profile
