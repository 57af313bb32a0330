#include "fabric/profile/profile.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>

#include <arpa/inet.h>
#include <fmt/format.h>

#include "base/configuration/check.hpp"
#include "fabric/profile/credentials.hpp"
#include "fabric/trust/permissions.hpp"
#include "idl/fabric.pb.h"

namespace millrace::fabric::profile {

namespace {

using base::configuration::Mistakes;

/// Enough for a host's services, and few enough for packet filters and for searching peers.
constexpr std::uint32_t default_processes = 20;

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

bool is_loopback(const std::string& interface) {
  return interface == "lo" || interface.starts_with("127.");
}

void check_names(const config::Fabric& profile, Mistakes& mistakes) {
  mistakes.expect(
      dds::is_fabric_name(profile.fabric()), {{"fabric"}},
      fmt::format("\"{}\"; expected some text without '*', '?', '/' and ','", profile.fabric()));
  mistakes.expect(consists_of(profile.interface(), "_.-@"), {{"interface"}},
                  fmt::format("\"{}\"; expected the name of a network interface, as `ip link` "
                              "shows it, or its IPv4 address",
                              profile.interface()));
  for (int i = 0; i < profile.peers_size(); ++i) {
    mistakes.expect(
        consists_of(profile.peers(i), ".-"), {{"peers", i}},
        fmt::format("\"{}\"; expected a host's name or IPv4 address", profile.peers(i)));
  }
}

void check_protection(const config::Fabric& profile, Mistakes& mistakes) {
  if (profile.has_trust()) {
    mistakes.expect(!profile.unprotected(), {{"unprotected"}},
                    "true, beside trust { … }; expected one of them");
    mistakes.expect_range(profile.domain(), 0U, trust::last_domain, {{"domain"}});
    return;
  }
  mistakes.expect(
      is_loopback(profile.interface()) || profile.unprotected(), {{"interface"}},
      fmt::format("\"{}\" without trust: any process on this network could answer calls, own "
                  "machines and send commands; expected trust {{ folder: \"…\" }} (`millrace trust "
                  "init` makes one), or unprotected: true if that is meant",
                  profile.interface()));
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
    return "";
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

std::string profile_to_read(const char* named, const std::filesystem::path& of_host) {
  if (named != nullptr) {
    return named;
  }
  std::error_code none;
  return std::filesystem::exists(of_host, none) ? of_host.string() : "";
}

std::string cyclone_configuration(const config::Fabric& profile) {
  return fmt::format(
      "<General>{}<AllowMulticast>{}</AllowMulticast></General><Discovery>{}{}</Discovery>",
      interface_element(profile.interface()), profile.multicast() ? "spdp" : "false",
      ports_element(profile), peers_element(profile));
}

tl::expected<dds::ParticipantOptions, std::string> read_profile(const std::filesystem::path& file) {
  return base::configuration::load<config::Fabric>(
      file, [&](const config::Fabric& profile, Mistakes& mistakes) {
        check_names(profile, mistakes);
        check_protection(profile, mistakes);
        dds::ParticipantOptions options{.domain = profile.domain(),
                                        .fabric = profile.fabric(),
                                        .lease = std::chrono::milliseconds(profile.lease_ms()),
                                        .configuration = cyclone_configuration(profile)};
        if (profile.has_trust()) {
          const auto credentials =
              mistakes.take(credentials_of(profile.trust(), file), {{"trust"}, {"folder"}});
          options.trust = trust_of(credentials);
          options.configuration += credentials.cyclone_configuration;
        }
        return options;
      });
}

}  // namespace millrace::fabric::profile
