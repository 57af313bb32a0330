#include "cnc/simulator/objects/channel_state.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/answers.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::Result;

/// A read-only value.
Object value(std::string name, std::string type, std::uint32_t length,
             Bytes (*read)(const VirtualChannel&), std::string unit = "") {
  return {.name = std::move(name),
          .type = std::move(type),
          .length = length,
          .unit = std::move(unit),
          .read = [read](const Context& at) -> Result<Bytes> { return read(*at.channel); }};
}

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
Object single_step_mode() {
  return {.name = "single step mode",
          .type = "UNS32",
          .length = 4,
          .read = [](const Context& at) -> Result<Bytes> {
            return encode_u32(static_cast<std::uint32_t>(at.channel->program().single_step().mode));
          },
          .write = [](const Context& at, ads::BytesView in) -> Result<void> {
            return decode_u32(in).and_then([&](std::uint32_t number) -> Result<void> {
              const nc::SingleStep::Mode mode{number};
              if (mode > nc::SingleStep::Mode::to_next_motion) {
                return tl::unexpected(ads::ErrorCode::invalid_data);
              }
              nc::Channel& program = at.channel->program();
              program.set_single_step({program.single_step().enabled, mode});
              return {};
            });
          }};
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
  table.add(0x60, {.name = "AEP parameter number",
                   .type = "UNS32",
                   .length = 4,
                   .read = [](const Context& at) -> Result<Bytes> {
                     return encode_u32(static_cast<std::uint32_t>(parameters(at).size()));
                   }});
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
  table.add(0x1F, value("state", "UNS32", 4, state));
  table.add(0x20, value("mode", "UNS32", 4, mode));
}

void add_interpolator_state(ObjectTable& table) {
  table.add(0x1, value("number of axes", "UNS16", 2, number_of_axes));
  table.add(0x8, value("rest path", "REAL64", 8, rest_path, "0.1 um"));
  table.add(0x15, value("path velocity", "REAL64", 8, velocity, "um/s"));
  table.add(0x1A, single_step_mode());
  table.add(0x21, value("block number", "SGN32", 4, block_number));
  table.add(0x22, value("rest of dwell", "REAL64", 8, dwell_left, "s"));
  table.add(0x2E, value("block count", "SGN32", 4, block_count));
  table.add(0x56, value("path from program start", "REAL64", 8, path, "0.1 um"));
}

}  // namespace millrace::cnc::simulator::objects
