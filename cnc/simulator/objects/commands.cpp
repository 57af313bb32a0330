#include "cnc/simulator/objects/commands.hpp"

#include <string>

#include "cnc/simulator/objects/answers.hpp"
#include "cnc/variables/text.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

/// Bytes of a program's name with its NUL; mdi takes longer texts.
constexpr std::uint32_t parameter_size = 2048;

Result<void> to_ads(const tl::expected<void, Refusal>& outcome) {
  return outcome ? Result<void>() : tl::unexpected(ErrorCode::invalid_data);
}

Result<void> write_mode(const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t number) -> Result<void> {
    const Mode mode{number};
    if (mode < Mode::standby || mode > Mode::reference) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    return to_ads(at.channel->command_mode(mode));
  });
}

Result<void> write_state(const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t number) {
    return to_ads(at.channel->command_state(ProcessState{number}));
  });
}

Result<void> write_parameter(const Context& at, BytesView in) {
  if (in.size() > parameter_size) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  at.channel->command_parameter(variables::decode_text(in));
  return {};
}

Result<void> write_execution_mode(const Context& /*at*/, BytesView in) {
  return decode_u32(in).and_then([](std::uint32_t mode) {
    return mode == 0 ? Result<void>() : tl::unexpected(ErrorCode::invalid_data);
  });
}

Result<Bytes> block_count(const Context& at) {
  return encode_u32(static_cast<std::uint32_t>(at.channel->program().motion().blocks));
}

/// In µm/s.
Result<Bytes> active_feedrate(const Context& at) {
  constexpr double micrometres_per_mm = 1e3;
  return encode_f64(at.channel->program().motion().velocity * micrometres_per_mm);
}

Result<Bytes> normal_execution(const Context& /*at*/) {
  return encode_u32(0);
}

}  // namespace

void add_commands(ObjectTable& table) {
  table.add(0x3F, {.name = "mc_command_execution_mode_w",
                   .type = "DINT",
                   .length = 4,
                   .write = write_execution_mode});
  table.add(0x40, {.name = "mc_command_execution_mode_r",
                   .type = "DINT",
                   .length = 4,
                   .read = normal_execution});
  table.add(0x41, {.name = "mc_active_execution_mode_r",
                   .type = "DINT",
                   .length = 4,
                   .read = normal_execution});
  table.add(0x104,
            {.name = "mc_command_mode_w", .type = "DWORD", .length = 4, .write = write_mode});
  table.add(0x105,
            {.name = "mc_command_state_w", .type = "DWORD", .length = 4, .write = write_state});
  table.add(0x108, {.name = "mc_command_parameter_w",
                    .type = "STRING",
                    .length = parameter_size,
                    .write = write_parameter});
  table.add(0x201, {.name = "mc_block_count_r", .type = "DWORD", .length = 4, .read = block_count});
  table.add(
      0x202,
      {.name = "mc_active_feedrate_r", .type = "LREAL", .length = 8, .read = active_feedrate});
}

}  // namespace millrace::cnc::simulator::objects
