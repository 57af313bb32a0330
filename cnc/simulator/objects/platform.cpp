#include "cnc/simulator/objects/platform.hpp"

#include <chrono>
#include <utility>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/answers.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::Result;

Object value(std::string name, std::string type, std::uint32_t length,
             Result<Bytes> (*read)(const Context&)) {
  return {.name = std::move(name), .type = std::move(type), .length = length, .read = read};
}

Result<Bytes> cycles(const Context& at) {
  return encode_u32(static_cast<std::uint32_t>(at.machine.cycles()));
}

Result<Bytes> cycle_time(const Context& at) {
  const auto time =
      std::chrono::duration_cast<std::chrono::microseconds>(at.machine.settings().cycle);
  return encode_u32(static_cast<std::uint32_t>(time.count()));
}

Result<Bytes> version(const Context& /*at*/) {
  constexpr std::size_t size = 24;
  return encode_buffer("millrace virtual CNC", size);
}

Result<Bytes> channels(const Context& at) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(at.machine.settings().channels)).take();
}

Result<Bytes> most_channels(const Context& /*at*/) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(max_channels)).take();
}

Result<Bytes> axes(const Context& at) {
  return encode_u32(at.machine.axes());
}

Result<Bytes> most_axes(const Context& /*at*/) {
  return encode_u32(max_channels * static_cast<std::uint32_t>(max_axes));
}

}  // namespace

void add_platform(ObjectTable& table) {
  table.add(0x1, value("cnc_tick_counter_r", "DWORD", 4, cycles));
  table.add(0x2, value("cnc_cycle_time_r", "DWORD", 4, cycle_time));
  table.add(0x3, value("cnc_version_r", "STRING", 24, version));
  table.add(0x4, value("cnc_number_of_channel_r", "WORD", 2, channels));
  table.add(0x5, value("cnc_number_of_channel_max_r", "WORD", 2, most_channels));
  table.add(0x6, value("cnc_number_of_axis_r", "DWORD", 4, axes));
  table.add(0x7, value("cnc_number_of_axis_max_r", "DWORD", 4, most_axes));
}

}  // namespace millrace::cnc::simulator::objects
