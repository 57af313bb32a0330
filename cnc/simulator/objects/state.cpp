#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/tables.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::Result;

/// A read-only value of a channel.
Object value(std::string name, std::string type, Bytes (*read)(const VirtualChannel&),
             std::string unit = "") {
  return object(
      std::move(name), std::move(type), [read](const Context& at) { return read(*at.channel); }, {},
      std::move(unit));
}

Bytes cycles(const Context& at) {
  return encode_u32(static_cast<std::uint32_t>(at.machine.cycles()));
}

Bytes cycle_time(const Context& at) {
  const auto time =
      std::chrono::duration_cast<std::chrono::microseconds>(at.machine.settings().cycle);
  return encode_u32(static_cast<std::uint32_t>(time.count()));
}

Result<Bytes> version(const Context& /*at*/) {
  constexpr std::size_t size = 24;
  return encode_buffer("millrace virtual CNC", size);
}

Bytes channels(const Context& at) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(at.machine.settings().channels)).take();
}

Bytes most_channels(const Context& /*at*/) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(max_channels)).take();
}

Bytes axes(const Context& at) {
  return encode_u32(at.machine.axes());
}

Bytes most_axes(const Context& /*at*/) {
  return encode_u32(max_channels * static_cast<std::uint32_t>(max_axes));
}

}  // namespace

void add_platform(ObjectTable& table) {
  table.add(0x1, object("cnc_tick_counter_r", "DWORD", cycles));
  table.add(0x2, object("cnc_cycle_time_r", "DWORD", cycle_time));
  table.add(0x3, {.name = "cnc_version_r", .type = "STRING", .length = 24, .read = version});
  table.add(0x4, object("cnc_number_of_channel_r", "WORD", channels));
  table.add(0x5, object("cnc_number_of_channel_max_r", "WORD", most_channels));
  table.add(0x6, object("cnc_number_of_axis_r", "DWORD", axes));
  table.add(0x7, object("cnc_number_of_axis_max_r", "DWORD", most_axes));
}

namespace {

Bytes state(const VirtualChannel& channel) {
  return encode_u32(static_cast<std::uint32_t>(channel.control().state()));
}

Bytes mode(const VirtualChannel& channel) {
  return encode_u32(static_cast<std::uint32_t>(channel.control().mode()));
}

Bytes number_of_axes(const VirtualChannel& channel) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(channel.axes().size())).take();
}

Bytes block_number(const VirtualChannel& channel) {
  return encode_s32(channel.program().block_number());
}

// The kernel's unit of length is 0.1 µm.
constexpr double tenths_of_a_micrometre_per_mm = 1e4;

Bytes rest_path(const VirtualChannel& channel) {
  return encode_f64(channel.program().motion().rest_path * tenths_of_a_micrometre_per_mm);
}

Bytes velocity(const VirtualChannel& channel) {
  return encode_f64(channel.program().motion().velocity * micrometres_per_mm);
}

Bytes dwell_left(const VirtualChannel& channel) {
  const std::chrono::duration<double> left = channel.program().motion().dwell_left;
  return encode_f64(left.count());
}

/// The mode of single steps (IB/tf5200_single_step_mode/306149899, documented).
Bytes single_step_mode(const Context& at) {
  return encode_u32(static_cast<std::uint32_t>(at.channel->program().single_step().mode));
}

Result<void> write_single_step_mode(const Context& at, ads::BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t number) -> Result<void> {
    const nc::SingleStep::Mode mode{number};
    if (mode > nc::SingleStep::Mode::to_next_motion) {
      return tl::unexpected(ads::ErrorCode::invalid_data);
    }
    nc::Channel& program = at.channel->program();
    program.set_single_step({program.single_step().enabled, mode});
    return {};
  });
}

Bytes block_count(const VirtualChannel& channel) {
  return encode_s32(static_cast<long>(channel.program().motion().blocks));
}

Bytes path(const VirtualChannel& channel) {
  return encode_f64(channel.program().motion().path * tenths_of_a_micrometre_per_mm);
}

const auto& parameters(const Context& at) {
  return at.machine.settings().aep_parameters;
}

/// The parameter at the index; invalid_data beyond the last one.
using AepParameter = std::pair<std::string, double>;
Result<const AepParameter*> parameter_at(const Context& at, ads::BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t index) -> Result<const AepParameter*> {
    return index < parameters(at).size() ? Result<const AepParameter*>(&parameters(at)[index])
                                         : tl::unexpected(ads::ErrorCode::invalid_data);
  });
}

}  // namespace

void add_aep_parameters(ObjectTable& table) {
  constexpr std::uint32_t name_size = 96;
  table.add(0x60, object("AEP parameter number", "UNS32", [](const Context& at) {
              return encode_u32(static_cast<std::uint32_t>(parameters(at).size()));
            }));
  table.add(0x61, {.name = "AEP-name by index",
                   .type = "STRING",
                   .length = name_size,
                   .exchange = [](const Context& at, ads::BytesView in) {
                     return parameter_at(at, in).and_then([](const AepParameter* found) {
                       return encode_buffer(found->first, name_size);
                     });
                   }});
  table.add(0x62, {.name = "AEP-value by name",
                   .type = "REAL64",
                   .length = 8,
                   .exchange = [](const Context& at, ads::BytesView in) -> Result<Bytes> {
                     return decode_name(in).and_then([&](std::string_view name) -> Result<Bytes> {
                       const auto found =
                           std::ranges::find(parameters(at), name, &AepParameter::first);
                       return found != parameters(at).end()
                                  ? Result<Bytes>(encode_f64(found->second))
                                  : tl::unexpected(at.machine.settings().answers.unknown_variable);
                     });
                   }});
  table.add(0x63, {.name = "AEP-value by index",
                   .type = "REAL64",
                   .length = 8,
                   .exchange = [](const Context& at, ads::BytesView in) {
                     return parameter_at(at, in).map(
                         [](const AepParameter* found) { return encode_f64(found->second); });
                   }});
}

void add_channel_state(ObjectTable& table) {
  table.add(0x1F, value("state", "UNS32", state));
  table.add(0x20, value("mode", "UNS32", mode));
}

void add_interpolator_state(ObjectTable& table) {
  table.add(0x1, value("number of axes", "UNS16", number_of_axes));
  table.add(0x8, value("rest path", "REAL64", rest_path, "0.1 um"));
  table.add(0x15, value("path velocity", "REAL64", velocity, "um/s"));
  table.add(0x1A, object("single step mode", "UNS32", single_step_mode, write_single_step_mode));
  table.add(0x21, value("block number", "SGN32", block_number));
  table.add(0x22, value("rest of dwell", "REAL64", dwell_left, "s"));
  table.add(0x2E, value("block count", "SGN32", block_count));
  table.add(0x56, value("path from program start", "REAL64", path, "0.1 um"));
}

namespace {

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
  return encode_s32(std::lround(millimetres * tenths_of_a_micrometre_per_mm));
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
  table.add(0x1, object("type", "WORD", type));
  table.add(0x2, object("command position", "DINT", position, {}, length_unit));
  table.add(0x3, object("actual position", "DINT", position, {}, length_unit));
  table.add(0x4, object("end position", "DINT", end_position, {}, length_unit));
  table.add(0x5, object("active feedrate", "LREAL", feedrate, {}, speed_unit));
  table.add(0x6, object("current feedrate", "LREAL", feedrate, {}, speed_unit));
  table.add(0x7, object("direction", "SINT", direction));
  table.add(0x9, {.name = "name", .type = "STRING", .length = axis_name_size, .read = name});
  table.add(0xA, object("in position", "BOOL", in_position));
  table.add(0xB, object("homing done", "BOOL", homing_done));
  table.add(0xF, object("channel", "WORD", channel_number));
}

void add_channel_axes(ObjectTable& table) {
  table.add(0x1, object("logical axis number", "WORD", logical_number));
  table.add(0x2, {.name = "name", .type = "STRING", .length = axis_name_size, .read = name});
  table.add(0x3, object("type", "WORD", type));
  table.add(0x4, object("distance to go", "DINT", distance_to_go, {}, length_unit));
  table.add(0x5, object("end position", "DINT", end_position, {}, length_unit));
  table.add(0x6, object("command position", "DINT", position, {}, length_unit));
  table.add(0x7, object("actual position", "DINT", position, {}, length_unit));
  table.add(0x8, object("homing done", "BOOL", homing_done));
}

void add_position_controller(ObjectTable& table) {
  table.add(0xD, object("actual velocity", "SGN32", speed32, {}, speed_unit));
  table.add(0x250, object("actual velocity, 64 bits", "SGN64", speed64, {}, speed_unit));
}

namespace {

using ads::BytesView;
using ads::ErrorCode;

/// The name with its axis, as the other functions expect it.
std::string with_axis(const Context& at, std::string_view name) {
  return fmt::format("{}.{}", name, at.channel->axes().at(at.axis - 1).name);
}

Result<Bytes> handle(const Context& at, BytesView in) {
  return decode_name(in).and_then([&](std::string_view name) -> Result<Bytes> {
    const auto found = at.channel->store().handle(with_axis(at, name));
    return found ? Result<Bytes>(encode_u32(*found))
                 : tl::unexpected(at.machine.settings().answers.unknown_variable);
  });
}

Result<Bytes> read(const Context& at, BytesView in) {
  return decode_name(in)
      .and_then([&](std::string_view name) { return find_variable(at, with_axis(at, name)); })
      .map([](const Selection& found) { return found.read(); });
}

Result<void> write(const Context& at, BytesView in) {
  const auto stream = variables::decode_name(in);
  if (!stream) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  return find_variable(at, with_axis(at, stream->name)).and_then([&](const Selection& found) {
    return found.write(stream->value);
  });
}

}  // namespace

void add_axis_functions(ObjectTable& table) {
  constexpr auto stream = static_cast<std::uint32_t>(variables::max_stream);
  table.add(0x4,
            {.name = "handle by name", .type = "STREAM", .length = stream, .exchange = handle});
  table.add(0x5, {.name = "read by name", .type = "STREAM", .length = stream, .exchange = read});
  table.add(0x6, {.name = "write by name", .type = "STREAM", .length = stream, .write = write});
}

}  // namespace millrace::cnc::simulator::objects
