#include <cmath>
#include <utility>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/tables.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

/// Bytes of a program's name with its NUL; mode mdi takes longer texts.
constexpr std::uint32_t parameter_size = 2048;

Result<void> to_ads(const tl::expected<void, Refusal>& outcome) {
  return outcome ? Result<void>() : tl::unexpected(ErrorCode::invalid_data);
}

Result<void> write_command_mode(const Context& at, BytesView in) {
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

Result<Bytes> encode_bool(bool value) {
  return Bytes{static_cast<std::uint8_t>(value ? 1 : 0)};
}

Result<bool> decode_bool(BytesView in) {
  return in.size() == 1 ? Result<bool>(in[0] != 0) : tl::unexpected(ErrorCode::invalid_size);
}

/// 1000 is 100 %.
constexpr double tenths_of_a_percent = 1e3;
constexpr std::uint16_t highest_override = 2000;

Result<void> write_override(const Context& at, BytesView in) {
  return decode_u16(in).and_then([&](std::uint16_t factor) -> Result<void> {
    if (factor > highest_override) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    at.channel->program().set_feed_override(factor / tenths_of_a_percent);
    return {};
  });
}

Result<Bytes> feed_override(const Context& at) {
  return encode_u16(std::lround(at.channel->program().feed_override() * tenths_of_a_percent));
}

Result<void> write_single_block(const Context& at, BytesView in) {
  return decode_bool(in).map([&](bool on) {
    nc::Channel& program = at.channel->program();
    program.set_single_step({on, program.single_step().mode});
  });
}

Result<void> write_optional_stop(const Context& at, BytesView in) {
  return decode_bool(in).map([&](bool on) { at.channel->program().set_optional_stop(on); });
}

/// Bit n - 1 is level n.
Result<void> write_skipped_levels(const Context& at, BytesView in) {
  constexpr std::uint32_t all_levels = 0x3FF;
  return decode_u32(in).and_then([&](std::uint32_t levels) -> Result<void> {
    if (levels > all_levels) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    at.channel->program().set_skipped_levels(static_cast<std::uint16_t>(levels));
    return {};
  });
}

Result<void> write_stream(const Context& at, BytesView in) {
  if (in.empty() || in.size() > parameter_size) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  return to_ads(at.channel->command_stream(variables::decode_text(in)));
}

Result<Bytes> program_name(const Context& at) {
  constexpr std::size_t size = 84;
  if (!at.machine.settings().answers.program_objects) {
    return tl::unexpected(ErrorCode::access_denied_index);
  }
  std::string_view name = at.channel->control().program();
  if (name.size() >= size) {
    // The name without its folder may fit; otherwise invalid_size.
    name.remove_prefix(name.rfind('/') + 1);
  }
  return encode_buffer(name, size);
}

Result<Bytes> error_id(const Context& at) {
  return at.machine.settings().answers.program_objects
             ? Result<Bytes>(encode_u32(at.channel->error()))
             : tl::unexpected(ErrorCode::access_denied_index);
}

Result<void> write_search_mode(const Context& at, BytesView in) {
  constexpr std::uint32_t normal = 0;
  constexpr std::uint32_t search_for_a_block = 1;
  return decode_u32(in).and_then([&](std::uint32_t mode) -> Result<void> {
    if (mode != normal && mode != search_for_a_block) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    BlockSearch search = at.channel->block_search();
    search.commanded = mode == search_for_a_block;
    at.channel->set_block_search(search);
    return {};
  });
}

Result<void> write_type(const Context& at, BytesView in) {
  constexpr std::uint16_t nothing = 0;
  constexpr std::uint16_t block_number = 4;
  return decode_u16(in).and_then([&](std::uint16_t type) -> Result<void> {
    if (type != nothing && type != block_number) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    BlockSearch search = at.channel->block_search();
    search.type = type;
    at.channel->set_block_search(search);
    return {};
  });
}

Result<void> write_block(const Context& at, BytesView in) {
  return decode_u32(in).map([&](std::uint32_t number) {
    BlockSearch search = at.channel->block_search();
    search.block = number;
    at.channel->set_block_search(search);
  });
}

/// Adds `both` twice: with its name and _w as write-only, and with _r as read-only.
void add_pair(ObjectTable& table, std::uint32_t write_at, std::uint32_t read_at,
              const Object& both) {
  Object command = both;
  command.name += "_w";
  command.read = {};
  Object answer = both;
  answer.name += "_r";
  answer.write = {};
  table.add(write_at, std::move(command));
  table.add(read_at, std::move(answer));
}

}  // namespace

void add_commands(ObjectTable& table) {
  add_pair(table, 0x1, 0x3,
           object(
               "mc_command_single_block", "BOOL", "",
               [](const Context& at) {
                 return encode_bool(at.channel->program().single_step().enabled);
               },
               write_single_block));
  add_pair(table, 0x9, 0xA,
           object("mc_command_feed_override", "WORD", "0.1 %", feed_override, write_override));
  table.add(0xC, object("mc_active_feed_override_r", "WORD", "0.1 %", feed_override));
  add_pair(table, 0x210, 0x211,
           object(
               "mc_command_block_ignore", "DWORD", "",
               [](const Context& at) { return encode_u32(at.channel->program().skipped_levels()); },
               write_skipped_levels));
  add_pair(table, 0x212, 0x213,
           object(
               "mc_command_M01_stop_enable", "BOOL", "",
               [](const Context& at) { return encode_bool(at.channel->program().optional_stop()); },
               write_optional_stop));
  add_pair(table, 0x3F, 0x40,
           object(
               "mc_command_execution_mode", "DINT", "",
               [](const Context& at) { return encode_u32(at.channel->block_search().commanded); },
               write_search_mode));
  table.add(0x41, object("mc_active_execution_mode_r", "DINT", "", [](const Context& at) {
              return encode_u32(at.channel->program().searching());
            }));
  add_pair(table, 0x49, 0x61,
           object(
               "mc_cmd_bs_type", "WORD", "",
               [](const Context& at) { return encode_u16(at.channel->block_search().type); },
               write_type));
  add_pair(table, 0x5F, 0x77,
           object(
               "mc_cmd_bs_block_number", "DWORD", "",
               [](const Context& at) { return encode_u32(at.channel->block_search().block); },
               write_block));
  table.add(0x90, {.name = "mc_program_stream_w",
                   .type = "STRING",
                   .length = parameter_size,
                   .write = write_stream});
  table.add(0x104, object("mc_command_mode_w", "DWORD", "", {}, write_command_mode));
  table.add(0x105, object("mc_command_state_w", "DWORD", "", {}, write_state));
  table.add(0x108, {.name = "mc_command_parameter_w",
                    .type = "STRING",
                    .length = parameter_size,
                    .write = write_parameter});
  table.add(0x201, object("mc_block_count_r", "DWORD", "", [](const Context& at) {
              return encode_u32(at.channel->program().motion().blocks);
            }));
  // In µm/s.
  table.add(0x202, object("mc_active_feedrate_r", "LREAL", "", [](const Context& at) {
              return encode_f64(at.channel->program().motion().velocity * micrometres_per_mm);
            }));
  table.add(
      0x203, object("mc_command_feedrate_r", "LREAL", "", [](const Context& at) {
        return encode_f64(at.channel->program().motion().programmed_velocity * micrometres_per_mm);
      }));
  table.add(0x214,
            {.name = "mc_program_name_r", .type = "STRING", .length = 84, .read = program_name});
  table.add(0x215, object("mc_error_id_r", "DWORD", "", error_id));
}

}  // namespace millrace::cnc::simulator::objects
