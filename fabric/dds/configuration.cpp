#include "fabric/dds/configuration.hpp"

#include <fstream>
#include <iterator>

namespace millrace::fabric::dds {

namespace {

// `lo` does multicast although its flag says no. Multicast is for discovery only: with a recorder
// on the network, multicast data wakes every process for every sample.
constexpr std::string_view loopback =
    R"(<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>)";

// Key hashes: without them another vendor's DDS disposes the wrong channel. Heartbeats: a request
// that is written before the other side knows its writer is repaired by the next heartbeat;
// Cyclone's defaults take up to 200 ms for that.
constexpr std::string_view settings =
    R"(<General><AllowMulticast>spdp</AllowMulticast></General>)"
    R"(<Internal><GenerateKeyhash>true</GenerateKeyhash>)"
    R"(<HeartbeatInterval min="1ms" minsched="5ms" max="1s">10ms</HeartbeatInterval>)"
    R"(<PreEmptiveAckDelay>1ms</PreEmptiveAckDelay><NackDelay>1ms</NackDelay></Internal>)";

constexpr std::string_view file_scheme = "file://";

std::string read_file(std::string_view path) {
  std::ifstream in{std::string(path), std::ios::binary};
  return {std::istreambuf_iterator<char>(in), {}};
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

}  // namespace

std::string cyclone_configuration(std::string_view extra, std::string_view uri) {
  std::string list(settings);
  if (!names_interface(extra) && !names_interface(uri)) {
    list.insert(0, loopback);
  }
  for (const std::string_view more : {extra, uri}) {
    if (!more.empty()) {
      list += ',';
      list += more;
    }
  }
  return list;
}

}  // namespace millrace::fabric::dds
