#include "cnc/simulator/objects/axis_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/answers.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::Result;

constexpr std::size_t axis_name_size = 16;
constexpr const char* length_unit = "0.1 um";
constexpr const char* speed_unit = "um/s";

nc::AxisPosition state_of(const Context& at) {
  return at.channel->program().axes().at(at.axis - 1);
}

double speed(const Context& at) {
  return state_of(at).velocity * micrometres_per_mm;
}

Bytes length(double millimetres) {
  constexpr double tenths_of_a_micrometre_per_mm = 1e4;
  return encode_s32(std::lround(millimetres * tenths_of_a_micrometre_per_mm));
}

Object value(std::string name, std::string type, std::uint32_t size, Bytes (*read)(const Context&),
             std::string unit = "") {
  return {.name = std::move(name),
          .type = std::move(type),
          .length = size,
          .unit = std::move(unit),
          .read = [read](const Context& at) -> Result<Bytes> { return read(at); }};
}

/// All axes are linear.
Bytes type(const Context& /*at*/) {
  constexpr std::uint16_t linear = 1;
  return ads::ByteWriter().u16(linear).take();
}

Bytes position(const Context& at) {
  return length(state_of(at).position);
}

Bytes end_position(const Context& at) {
  return length(state_of(at).target);
}

Bytes distance_to_go(const Context& at) {
  const nc::AxisPosition state = state_of(at);
  return length(state.target - state.position);
}

Bytes feedrate(const Context& at) {
  return encode_f64(speed(at));
}

Bytes direction(const Context& at) {
  const double now = speed(at);
  return {static_cast<std::uint8_t>(now > 0 ? 1 : (now < 0 ? -1 : 0))};
}

Bytes name(const Context& at) {
  const std::string& text = at.channel->axes().at(at.axis - 1).name;
  return encode_buffer(std::string_view(text).substr(0, axis_name_size - 1), axis_name_size)
      .value();
}

Bytes in_position(const Context& at) {
  return {static_cast<std::uint8_t>(speed(at) == 0 ? 1 : 0)};
}

/// Simulated axes need no homing.
Bytes homing_done(const Context& /*at*/) {
  return {1};
}

Bytes channel_number(const Context& at) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(at.channel->number())).take();
}

Bytes logical_number(const Context& at) {
  const std::uint32_t number = at.machine.first_axis(at.channel->number()) + at.axis - 1;
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(number)).take();
}

Bytes speed32(const Context& at) {
  return encode_s32(std::lround(speed(at)));
}

Bytes speed64(const Context& at) {
  return ads::ByteWriter().u64(static_cast<std::uint64_t>(std::llround(speed(at)))).take();
}

}  // namespace

void add_axes(ObjectTable& table) {
  table.add(0x1, value("type", "WORD", 2, type));
  table.add(0x2, value("command position", "DINT", 4, position, length_unit));
  table.add(0x3, value("actual position", "DINT", 4, position, length_unit));
  table.add(0x4, value("end position", "DINT", 4, end_position, length_unit));
  table.add(0x5, value("active feedrate", "LREAL", 8, feedrate, speed_unit));
  table.add(0x6, value("current feedrate", "LREAL", 8, feedrate, speed_unit));
  table.add(0x7, value("direction", "SINT", 1, direction));
  table.add(0x9, value("name", "STRING", axis_name_size, name));
  table.add(0xA, value("in position", "BOOL", 1, in_position));
  table.add(0xB, value("homing done", "BOOL", 1, homing_done));
  table.add(0xF, value("channel", "WORD", 2, channel_number));
}

void add_channel_axes(ObjectTable& table) {
  table.add(0x1, value("logical axis number", "WORD", 2, logical_number));
  table.add(0x2, value("name", "STRING", axis_name_size, name));
  table.add(0x3, value("type", "WORD", 2, type));
  table.add(0x4, value("distance to go", "DINT", 4, distance_to_go, length_unit));
  table.add(0x5, value("end position", "DINT", 4, end_position, length_unit));
  table.add(0x6, value("command position", "DINT", 4, position, length_unit));
  table.add(0x7, value("actual position", "DINT", 4, position, length_unit));
  table.add(0x8, value("homing done", "BOOL", 1, homing_done));
}

void add_position_controller(ObjectTable& table) {
  table.add(0xD, value("actual velocity", "SGN32", 4, speed32, speed_unit));
  table.add(0x250, value("actual velocity, 64 bits", "SGN64", 8, speed64, speed_unit));
}

}  // namespace millrace::cnc::simulator::objects
