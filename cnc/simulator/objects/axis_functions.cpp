#include "cnc/simulator/objects/axis_functions.hpp"

#include <string>

#include <fmt/format.h>

#include "cnc/simulator/objects/answers.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

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
