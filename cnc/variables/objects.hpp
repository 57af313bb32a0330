// The objects of the tasks GEO (port 551) and COM (port 553): numbers and texts at fixed addresses,
// by name. Pure.
//
//   auto place = find_geo_object("block_number", 1);
//   auto entry = decode_directory_record(bytes);               // an object of COM (readings.hpp)
//
// A GEO object has no documented name: its name is ours. Its address comes from an open-source
// client of real controllers (inferred), unless the table names a source. COM objects have the
// vendor's names, mc_… for a channel and cnc_… for the controller. They are found in the
// controller's own directory (IB/tf5200_ads_access_to_cnc/855973643, documented).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "cnc/ads/device.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

/// AMS ports of the tasks (IB/tf527x_kernelv_api/402275851, documented).
inline constexpr std::uint16_t geo_port = 551;
inline constexpr std::uint16_t com_port = 553;

/// The address and the type of an object.
struct ObjectPlace {
  std::uint16_t port = geo_port;
  ads::Index index;
  ElementType type;
  bool operator==(const ObjectPlace&) const = default;
};

struct GeoObject {
  std::string_view name;
  /// For channel 0; add the channel's number.
  std::uint32_t group = 0;
  std::uint32_t offset = 0;
  Type type = Type::uns32;
  std::string_view meaning;
};

/// The object of a channel, counted from 1; nullopt if the name is unknown.
std::optional<ObjectPlace> find_geo_object(std::string_view name, std::uint32_t channel);

/// True for the names of COM's directory, mc_… and cnc_….
bool is_com_name(std::string_view name);

/// An object of COM's directory.
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
/// Decodes one record; nullopt for fewer bytes.
std::optional<DirectoryEntry> decode_directory_record(BytesView bytes);

/// The type of the object's value. Fails with the reason if the type is not a number or text of a
/// CNC.
tl::expected<ElementType, std::string> element_type(const DirectoryEntry& entry);

}  // namespace millrace::cnc::variables
