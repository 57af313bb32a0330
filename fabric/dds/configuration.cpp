#include "fabric/dds/configuration.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <stdexcept>

#include <dds/dds.h>
#include <fmt/format.h>

#include "base/posix/guarded_file.hpp"
#include "base/program/barrier.hpp"
#include "base/program/repeats.hpp"
#include "base/text/quoted.hpp"

namespace millrace::fabric::dds {

namespace {

// `lo` supports multicast although its flag does not show it. Multicast is used only for discovery:
// with a recorder on the network, multicast data would wake every process for every sample.
constexpr std::string_view loopback =
    R"(<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>)";

// Key hashes: without them another vendor's DDS disposes the wrong channel. Acknowledgements: a
// reader requests a sample that was written before it was matched with its first acknowledgement,
// and Cyclone's defaults delay that by up to 200 ms. DDS heartbeats: a reader requests lost samples
// after a heartbeat. Each heartbeat goes to all readers of a writer, so ten times as many
// heartbeats would let the start of a hundred processes take ten times as long.
constexpr std::string_view settings =
    R"(<General><AllowMulticast>spdp</AllowMulticast></General>)"
    R"(<Internal><GenerateKeyhash>true</GenerateKeyhash>)"
    R"(<HeartbeatInterval min="20ms" minsched="50ms" max="1s">200ms</HeartbeatInterval>)"
    R"(<PreEmptiveAckDelay>1ms</PreEmptiveAckDelay><NackDelay>1ms</NackDelay></Internal>)";

// Cyclone requests the keys of a participant as soon as it has accepted its certificate, and may
// put that request and the end of the handshake into one packet. Fast DDS drops a packet from the
// first part on for which it has no key, and Cyclone (0.10.2) does not repeat the end of the
// handshake if everything else is protected: the two would never match. A handshake takes longer
// than this delay, so the delay costs nothing.
constexpr std::string_view handshaking =
    R"(,<Internal><PreEmptiveAckDelay>40ms</PreEmptiveAckDelay></Internal>)";

// A process that receives announcements finds another one by the announcement at its start; these
// are for announcements that were lost then.
constexpr std::string_view hearing = R"(<Discovery><SPDPInterval>5s</SPDPInterval></Discovery>)";

constexpr std::string_view file_scheme = "file://";

/// Cyclone itself reads files of any kind and length, and reports one that is missing.
std::string read_file(const std::filesystem::path& file) {
  std::error_code unreadable;
  if (!std::filesystem::exists(file, unreadable)) {
    return {};
  }
  auto text = base::posix::read_regular(file);
  if (!text) {
    throw std::runtime_error(fmt::format(
        "CYCLONEDDS_URI names {}: {}; expected a file with Cyclone's settings, or the settings",
        base::text::safe(file.string()), text.error()));
  }
  return *std::move(text);
}

/// Cyclone's list: fragments of XML start with '<', everything else up to the next comma is a file.
bool names_interface(std::string_view list) {
  constexpr std::string_view element = "<NetworkInterface";
  if (list.find(element) != std::string_view::npos) {
    return true;
  }
  while (!list.empty()) {
    const auto comma = list.find(',');
    std::string_view item = list.substr(0, comma);
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
    if (item.starts_with(file_scheme)) {
      item.remove_prefix(file_scheme.size());
    }
    if (!item.starts_with('<') && read_file(item).find(element) != std::string::npos) {
      return true;
    }
  }
  return false;
}

/// The group is that of DDS, which the listening processes join; the port is that of this domain.
std::string announcing(std::uint32_t domain) {
  constexpr std::uint32_t base_port = 7400;
  constexpr std::uint32_t domain_gain = 250;
  return fmt::format(
      ",<General><AllowMulticast>false</AllowMulticast></General>"
      "<Discovery><SPDPInterval>400ms</SPDPInterval>"
      R"(<Peers><Peer Address="239.255.0.1:{}"/></Peers></Discovery>)",
      base_port + domain_gain * domain);
}

// Cyclone 0.10 sends each announcement to the addresses of all processes it found, also ended ones
// (as_disc; Cyclone 11 removes them). If each process took a new port, a service would send
// thousands of datagrams a second after thousands of tools, and find no process any more.
std::string ports_element(Ports ports) {
  return ports == Ports::any
             ? ",<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"
             : fmt::format(
                   ",<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                   "<MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex></Discovery>",
                   lowest_ports);
}

/// A configuration with its own discovery settings is not changed.
bool finds_otherwise(std::string_view list) {
  return list.find("<Peers>") != std::string_view::npos ||
         list.find("<AllowMulticast>false") != std::string_view::npos ||
         list.find("<ExternalDomainId>") != std::string_view::npos ||
         list.find("<SPDPMulticastAddress>") != std::string_view::npos ||
         list.find("<Ports>") != std::string_view::npos;
}

}  // namespace

bool uses_uri(const ParticipantOptions& options) {
  return options.configuration.empty();
}

std::string cyclone_configuration(const ParticipantOptions& options, std::string_view uri,
                                  Ports ports) {
  const std::string_view extra = uses_uri(options) ? uri : options.configuration;
  std::string list(settings);
  if (options.trust) {
    list += handshaking;
  }
  const bool usual = uses_uri(options) ? uri.empty() : !finds_otherwise(extra);
  if (usual && options.finding == Finding::discovers) {
    list += hearing;
  }
  if (usual && extra.find("<ParticipantIndex>") == std::string_view::npos) {
    list += ports_element(ports);
  }
  if (!names_interface(extra)) {
    list.insert(0, loopback);
  }
  if (!extra.empty()) {
    list += ',';
    list += extra;
  }
  if (usual && options.finding == Finding::announces) {
    list += announcing(options.domain);
  }
  return list;
}

std::string configuration_without_place(const ParticipantOptions& options, std::string_view uri) {
  return cyclone_configuration(options, uri) + ports_element(Ports::any);
}

bool lacks_place(std::string_view log) {
  return log.find("participant index") != std::string_view::npos;
}

std::string why_not_joined(std::uint32_t domain, std::string_view reason, std::string_view log,
                           std::string_view uri) {
  std::string why = fmt::format("cannot join DDS domain {}: {}", domain, reason);
  if (lacks_place(log)) {
    why +=
        "; other processes have all places of this host: raise processes_per_host in the fabric's "
        "profile, on all hosts (in CYCLONEDDS_URI it is MaxAutoParticipantIndex), or end one";
  } else if (log.find("does not match an available interface") != std::string_view::npos) {
    why += "; correct `interface` in the fabric's profile: `ip address` lists those of this host";
  } else if (!uri.empty()) {
    why += fmt::format(
        "; CYCLONEDDS_URI applies, since no profile (--fabric-config) configures the network: "
        "correct or unset it ({})",
        base::text::safe(uri));
  }
  while (!log.empty()) {
    const std::size_t end = std::min(log.find('\n'), log.size());
    why += fmt::format("\n  Cyclone: {}", base::text::safe(log.substr(0, end)));
    log.remove_prefix(std::min(end + 1, log.size()));
  }
  return why;
}

namespace {

struct Log {
  std::mutex lock;
  base::program::Repeats repeats;
};

/// Never destroyed: Cyclone's threads may log until the end of the process.
Log& log() {
  static Log& only = *new Log;
  return only;
}

/// Cyclone deletes a participant with an expired certificate itself, and does not find it when it
/// is deleted here.
constexpr std::string_view deleted_already = "dds_participant_delete: internal error -3";

std::atomic<bool> hides_rejections = false;

void write(void*, const dds_log_data_t* data) noexcept {
  base::program::contain("writing the log of Cyclone DDS", [&] {
    const std::string_view header(data->message - data->hdrsize, data->hdrsize);
    const std::string text(data->message, data->size);
    if (text.starts_with(deleted_already) || (hides_rejections && is_rejection(text))) {
      return;
    }
    const std::lock_guard guard(log().lock);
    if (const auto line =
            log().repeats.note(kind_of_line(text), text, std::chrono::steady_clock::now())) {
      const std::string whole = std::string(header) + *line + '\n';
      std::fwrite(whole.data(), 1, whole.size(), stderr);
    }
  });
}

}  // namespace

std::string kind_of_line(std::string_view text) {
  std::string kind;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    const bool has_digit =
        std::any_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
    kind += has_digit ? std::string_view("#") : word;
    kind += ' ';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return kind;
}

void hide_rejections() {
  hides_rejections = true;
}

bool is_rejection(std::string_view line) {
  return line.find("Process handshake failed") != std::string_view::npos;
}

void take_cyclone_log() {
  dds_set_log_sink(&write, nullptr);
}

}  // namespace millrace::fabric::dds
