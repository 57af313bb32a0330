#include "cnc/variables/objects.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "cnc/variables/addresses.hpp"
#include "cnc/variables/names.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

namespace {

constexpr std::uint32_t channel_state_group = 0x123300;
constexpr std::uint32_t interpolator_group = 0x121300;

constexpr std::array<GeoObject, 9> all_geo_objects{{
    {"state", channel_state_group, 0x1F, Type::uns32,
     "state of the program: 1 deselected, 2 selected, 3 ready, 4 active, 5 hold, 6 error"},
    {"mode", channel_state_group, 0x20, Type::uns32,
     "operation mode: 1 standby, 2 automatic, 3 MDI, 4 manual, 5 reference"},
    {"number_of_axes", interpolator_group, 0x1, Type::uns16, "axes of the channel"},
    {"rest_path", interpolator_group, 0x8, Type::real64, "rest of the path in the block, 0.1 um"},
    {"path_velocity", interpolator_group, 0x15, Type::real64, "velocity on the path, um/s"},
    {"block_number", interpolator_group, 0x21, Type::sgn32, "N number of the block in execution"},
    {"dwell_rest", interpolator_group, 0x22, Type::real64, "rest of a dwell, s"},
    {"block_count", interpolator_group, 0x2E, Type::sgn32, "blocks executed"},
    // IB/tf5200_blocksearch/348569355, documented.
    {"path_from_start", interpolator_group, 0x56, Type::real64,
     "path since the start of the program, 0.1 um"},
}};

struct ComType {
  std::string_view name;
  Type type;
  std::uint32_t size;
};

/// The types of the directory page that are values of a CNC.
constexpr std::array<ComType, 9> com_types{{
    {"BOOL", Type::boolean, 1},
    {"BYTE", Type::uns08, 1},
    {"SINT", Type::sgn08, 1},
    {"WORD", Type::uns16, 2},
    {"INT", Type::sgn16, 2},
    {"DWORD", Type::uns32, 4},
    {"DINT", Type::sgn32, 4},
    {"LREAL", Type::real64, 8},
    {"STRING", Type::string, 0},
}};

}  // namespace

std::optional<ObjectPlace> find_geo_object(std::string_view name, std::uint32_t channel) {
  const auto* const found = std::ranges::find(all_geo_objects, name, &GeoObject::name);
  if (found == all_geo_objects.end()) {
    return std::nullopt;
  }
  return ObjectPlace{
      geo_port, {found->group + channel, found->offset}, {found->type, size_of(found->type)}};
}

bool is_com_name(std::string_view name) {
  return name.starts_with("mc_") || name.starts_with("cnc_");
}

std::optional<DirectoryEntry> decode_directory_record(BytesView bytes) {
  constexpr std::size_t field_size = 32;
  if (bytes.size() < directory_record) {
    return std::nullopt;
  }
  ads::ByteReader in(bytes);
  DirectoryEntry entry;
  in.u32();  // an id that the controller uses internally
  entry.size = in.u32();
  entry.writable = in.u16() != 0;
  in.u16();
  entry.index.group = in.u32();
  entry.index.offset = in.u32();
  entry.name = decode_text(in.take(field_size));
  entry.type = decode_text(in.take(field_size));
  return entry;
}

tl::expected<ElementType, std::string> element_type(const DirectoryEntry& entry) {
  const auto* const found = std::ranges::find(com_types, entry.type, &ComType::name);
  const bool fits = found != com_types.end() && (found->size == 0 || found->size == entry.size) &&
                    entry.size > 0 && entry.size <= max_stream;
  if (!fits) {
    return tl::unexpected(
        fmt::format("the controller describes it as a {} of {} bytes; a CNC has no such value",
                    entry.type, entry.size));
  }
  return ElementType{found->type, entry.size};
}

}  // namespace millrace::cnc::variables
