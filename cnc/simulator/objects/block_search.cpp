#include "cnc/simulator/objects/block_search.hpp"

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/answers.hpp"
#include "cnc/simulator/objects/command_pair.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

constexpr std::uint32_t normal_execution = 0;
constexpr std::uint32_t search_execution = 1;

std::uint32_t mode_of(bool searching) {
  return searching ? search_execution : normal_execution;
}

Result<void> write_search_mode(const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t mode) -> Result<void> {
    if (mode != normal_execution && mode != search_execution) {
      return tl::unexpected(ErrorCode::invalid_data);
    }
    BlockSearch search = at.channel->block_search();
    search.commanded = mode == search_execution;
    at.channel->set_block_search(search);
    return {};
  });
}

Result<Bytes> commanded_mode(const Context& at) {
  return encode_u32(mode_of(at.channel->block_search().commanded));
}

Result<Bytes> active_mode(const Context& at) {
  return encode_u32(mode_of(at.channel->program().searching()));
}

Result<void> write_type(const Context& at, BytesView in) {
  constexpr std::uint16_t nothing = 0;
  constexpr std::uint16_t block_number = 4;
  ads::ByteReader reader(in);
  BlockSearch search = at.channel->block_search();
  search.type = reader.u16();
  if (!reader.exact()) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  if (search.type != nothing && search.type != block_number) {
    return tl::unexpected(ErrorCode::invalid_data);
  }
  at.channel->set_block_search(search);
  return {};
}

Result<Bytes> search_type(const Context& at) {
  return ads::ByteWriter().u16(at.channel->block_search().type).take();
}

Result<void> write_block(const Context& at, BytesView in) {
  return decode_u32(in).map([&](std::uint32_t number) {
    BlockSearch search = at.channel->block_search();
    search.block = number;
    at.channel->set_block_search(search);
  });
}

Result<Bytes> block(const Context& at) {
  return encode_u32(at.channel->block_search().block);
}

}  // namespace

void add_block_search(ObjectTable& table) {
  add_pair(table, 0x3F, 0x40,
           {.name = "mc_command_execution_mode",
            .type = "DINT",
            .length = 4,
            .read = commanded_mode,
            .write = write_search_mode});
  table.add(
      0x41,
      {.name = "mc_active_execution_mode_r", .type = "DINT", .length = 4, .read = active_mode});
  add_pair(table, 0x49, 0x61,
           {.name = "mc_cmd_bs_type",
            .type = "WORD",
            .length = 2,
            .read = search_type,
            .write = write_type});
  add_pair(table, 0x5F, 0x77,
           {.name = "mc_cmd_bs_block_number",
            .type = "DWORD",
            .length = 4,
            .read = block,
            .write = write_block});
}

}  // namespace millrace::cnc::simulator::objects
