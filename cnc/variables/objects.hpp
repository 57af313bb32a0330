// The objects of the tasks GEO (port 551) and COM (port 553): numbers and texts at fixed places, by
// name. Pure.
//
//   auto place = find_geo_object("block_number", 1);
//   auto entry = decode_directory_record(bytes);               // what COM has (readings.hpp)
//
// A GEO object has no documented name; its name here is ours, its address that of an open-source
// client of real controllers (inferred), but where the table says otherwise. COM objects have the
// vendor's names, mc_… of a channel and cnc_… of the controller, and are found in the controller's
// own directory (IB/tf5200_ads_access_to_cnc/855973643, documented).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

/// AMS ports of the tasks (IB/tf527x_kernelv_api/402275851, documented).
inline constexpr std::uint16_t geo_port = 551;
inline constexpr std::uint16_t com_port = 553;

/// Where an object is and what it holds.
struct ObjectPlace {
  std::uint16_t port = geo_port;
  ads::Index index;
  ElementType type;
  bool operator==(const ObjectPlace&) const = default;
};

struct GeoObject {
  std::string_view name;
  /// Of channel 0; the channel is added.
  std::uint32_t group = 0;
  std::uint32_t offset = 0;
  Type type = Type::uns32;
  std::string_view meaning;
};

/// All that are known.
std::span<const GeoObject> geo_objects();
/// The object of a channel, counted from 1; nothing if there is none of this name.
std::optional<ObjectPlace> find_geo_object(std::string_view name, std::uint32_t channel);

/// True for mc_… and cnc_…, which COM's directory has.
bool is_com_name(std::string_view name);

/// An object as COM's directory tells it.
struct DirectoryEntry {
  std::string name;
  /// "DWORD", "LREAL", …
  std::string type;
  ads::Index index;
  std::uint32_t size = 0;
  bool writable = false;
  bool operator==(const DirectoryEntry&) const = default;
};

/// Bytes of a record of the directory.
inline constexpr std::size_t directory_record = 84;
/// One record; nothing for fewer bytes.
std::optional<DirectoryEntry> decode_directory_record(BytesView bytes);

/// What can be read there; the error says why it cannot: a type that is no number or text of a CNC.
tl::expected<ElementType, std::string> element_type(const DirectoryEntry& entry);

}  // namespace millrace::cnc::variables
