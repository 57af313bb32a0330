#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "cnc/simulator/objects/tables.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

/// A read-only value of a channel.
Object value(std::string name, std::string type, std::string unit,
             Bytes (*read)(const VirtualChannel&)) {
  return object(std::move(name), std::move(type), std::move(unit),
                [read](const Context& at) { return read(*at.channel); });
}

}  // namespace

void add_platform(ObjectTable& table) {
  table.add(0x1, object("cnc_tick_counter_r", "DWORD", "",
                        [](const Context& at) { return encode_u32(at.machine.cycles()); }));
  table.add(
      0x2, object("cnc_cycle_time_r", "DWORD", "", [](const Context& at) {
        const auto cycle = at.machine.settings().cycle;
        return encode_u32(std::chrono::duration_cast<std::chrono::microseconds>(cycle).count());
      }));
  table.add(0x3,
            {.name = "cnc_version_r", .type = "STRING", .length = 24, .read = [](const Context&) {
               return encode_buffer("millrace virtual CNC", 24);
             }});
  table.add(0x4, object("cnc_number_of_channel_r", "WORD", "", [](const Context& at) {
              return encode_u16(at.machine.settings().channels);
            }));
  table.add(0x5, object("cnc_number_of_channel_max_r", "WORD", "",
                        [](const Context&) { return encode_u16(max_channels); }));
  table.add(0x6, object("cnc_number_of_axis_r", "DWORD", "",
                        [](const Context& at) { return encode_u32(at.machine.axes()); }));
  table.add(0x7, object("cnc_number_of_axis_max_r", "DWORD", "",
                        [](const Context&) { return encode_u32(max_channels * max_axes); }));
}

void add_channel_state(ObjectTable& table) {
  table.add(0x1F, value("state", "UNS32", "", [](const VirtualChannel& channel) {
              return encode_u32(channel.control().state());
            }));
  table.add(0x20, value("mode", "UNS32", "", [](const VirtualChannel& channel) {
              return encode_u32(channel.control().mode());
            }));
}

namespace {

// The kernel's unit of length is 0.1 µm.
constexpr double tenths_of_a_micrometre_per_mm = 1e4;
constexpr const char* length_unit = "0.1 um";
constexpr const char* speed_unit = "um/s";

/// The mode of single steps (IB/tf5200_single_step_mode/306149899, documented).
Result<void> write_single_step_mode(const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t number) -> Result<void> {
    const nc::SingleStep::Mode mode{number};
    if (mode > nc::SingleStep::Mode::to_next_motion) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    nc::Channel& program = at.channel->program();
    program.set_single_step({program.single_step().enabled, mode});
    return {};
  });
}

}  // namespace

void add_interpolator_state(ObjectTable& table) {
  table.add(0x1, value("number of axes", "UNS16", "", [](const VirtualChannel& channel) {
              return encode_u16(channel.axes().size());
            }));
  table.add(
      0x8, value("rest path", "REAL64", length_unit, [](const VirtualChannel& channel) {
        return encode_f64(channel.program().motion().rest_path * tenths_of_a_micrometre_per_mm);
      }));
  table.add(0x15, value("path velocity", "REAL64", speed_unit, [](const VirtualChannel& channel) {
              return encode_f64(channel.program().motion().velocity * micrometres_per_mm);
            }));
  table.add(0x1A, object(
                      "single step mode", "UNS32", "",
                      [](const Context& at) {
                        return encode_u32(at.channel->program().single_step().mode);
                      },
                      write_single_step_mode));
  table.add(0x21, value("block number", "SGN32", "", [](const VirtualChannel& channel) {
              return encode_s32(channel.program().block_number());
            }));
  table.add(0x22, value("rest of dwell", "REAL64", "s", [](const VirtualChannel& channel) {
              const std::chrono::duration<double> left = channel.program().motion().dwell_left;
              return encode_f64(left.count());
            }));
  table.add(0x2E, value("block count", "SGN32", "", [](const VirtualChannel& channel) {
              return encode_s32(static_cast<long>(channel.program().motion().blocks));
            }));
  table.add(
      0x56,
      value("path from program start", "REAL64", length_unit, [](const VirtualChannel& channel) {
        return encode_f64(channel.program().motion().path * tenths_of_a_micrometre_per_mm);
      }));
}

namespace {

const auto& parameters(const Context& at) {
  return at.machine.settings().aep_parameters;
}

/// The parameter at the index; invalid_data beyond the last one.
using AepParameter = std::pair<std::string, double>;
Result<const AepParameter*> parameter_at(const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t index) -> Result<const AepParameter*> {
    return index < parameters(at).size() ? Result<const AepParameter*>(&parameters(at)[index])
                                         : tl::unexpected(ErrorCode::invalid_data);
  });
}

}  // namespace

void add_aep_parameters(ObjectTable& table) {
  constexpr std::uint32_t name_size = 96;
  table.add(0x60, object("AEP parameter number", "UNS32", "",
                         [](const Context& at) { return encode_u32(parameters(at).size()); }));
  table.add(0x61, {.name = "AEP-name by index",
                   .type = "STRING",
                   .length = name_size,
                   .exchange = [](const Context& at, BytesView in) {
                     return parameter_at(at, in).and_then([](const AepParameter* found) {
                       return encode_buffer(found->first, name_size);
                     });
                   }});
  table.add(0x62, {.name = "AEP-value by name",
                   .type = "REAL64",
                   .length = 8,
                   .exchange = [](const Context& at, BytesView in) -> Result<Bytes> {
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
                   .exchange = [](const Context& at, BytesView in) {
                     return parameter_at(at, in).map(
                         [](const AepParameter* found) { return encode_f64(found->second); });
                   }});
}

namespace {

constexpr std::size_t axis_name_size = 16;

nc::AxisPosition state_of(const Context& at) {
  return at.channel->program().axes().at(at.axis - 1);
}

double speed(const Context& at) {
  return state_of(at).velocity * micrometres_per_mm;
}

Bytes length(double millimetres) {
  return encode_s32(std::lround(millimetres * tenths_of_a_micrometre_per_mm));
}

Object axis_length(std::string name, double (*millimetres)(const nc::AxisPosition&)) {
  return object(std::move(name), "DINT", length_unit,
                [millimetres](const Context& at) { return length(millimetres(state_of(at))); });
}

Object position(std::string name) {
  return axis_length(std::move(name), [](const nc::AxisPosition& axis) { return axis.position; });
}

Object end_position() {
  return axis_length("end position", [](const nc::AxisPosition& axis) { return axis.target; });
}

/// All axes are linear.
Object type() {
  return object("type", "WORD", "", [](const Context&) { return encode_u16(1); });
}

Object feedrate(std::string name) {
  return object(std::move(name), "LREAL", speed_unit,
                [](const Context& at) { return encode_f64(speed(at)); });
}

Object name() {
  return {
      .name = "name", .type = "STRING", .length = axis_name_size, .read = [](const Context& at) {
        const std::string& text = at.channel->axes().at(at.axis - 1).name;
        return encode_buffer(text.substr(0, axis_name_size - 1), axis_name_size);
      }};
}

/// Simulated axes need no homing.
Object homing_done() {
  return object("homing done", "BOOL", "", [](const Context&) { return Bytes{1}; });
}

}  // namespace

void add_axes(ObjectTable& table) {
  table.add(0x1, type());
  table.add(0x2, position("command position"));
  table.add(0x3, position("actual position"));
  table.add(0x4, end_position());
  table.add(0x5, feedrate("active feedrate"));
  table.add(0x6, feedrate("current feedrate"));
  table.add(0x7, object("direction", "SINT", "", [](const Context& at) {
              const double now = speed(at);
              return Bytes{static_cast<std::uint8_t>(now > 0 ? 1 : (now < 0 ? -1 : 0))};
            }));
  table.add(0x9, name());
  table.add(0xA, object("in position", "BOOL", "", [](const Context& at) {
              return Bytes{static_cast<std::uint8_t>(speed(at) == 0 ? 1 : 0)};
            }));
  table.add(0xB, homing_done());
  table.add(0xF, object("channel", "WORD", "",
                        [](const Context& at) { return encode_u16(at.channel->number()); }));
}

void add_channel_axes(ObjectTable& table) {
  table.add(0x1, object("logical axis number", "WORD", "", [](const Context& at) {
              return encode_u16(at.machine.first_axis(at.channel->number()) + at.axis - 1);
            }));
  table.add(0x2, name());
  table.add(0x3, type());
  table.add(0x4, axis_length("distance to go", [](const nc::AxisPosition& axis) {
              return axis.target - axis.position;
            }));
  table.add(0x5, end_position());
  table.add(0x6, position("command position"));
  table.add(0x7, position("actual position"));
  table.add(0x8, homing_done());
}

void add_position_controller(ObjectTable& table) {
  table.add(0xD, object("actual velocity", "SGN32", speed_unit,
                        [](const Context& at) { return encode_s32(std::lround(speed(at))); }));
  table.add(0x250, object("actual velocity, 64 bits", "SGN64", speed_unit, [](const Context& at) {
              const auto now = static_cast<std::uint64_t>(std::llround(speed(at)));
              return ads::ByteWriter().u64(now).take();
            }));
}

namespace {

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
