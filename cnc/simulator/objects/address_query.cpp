#include "cnc/simulator/objects/address_query.hpp"

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/catalogue.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

bool exists(Machine& machine, GroupKind kind, std::uint32_t channel, std::uint32_t axis) {
  if (kind == GroupKind::position_controller) {
    return channel == 0 && machine.axis(axis).has_value();
  }
  const VirtualChannel* const found = machine.channel(channel);
  if (found == nullptr) {
    return false;
  }
  return axis == 0 || (kind == GroupKind::decoder && axis <= found->axes().size());
}

}  // namespace

Object address_query(GroupKind kind) {
  return {.name = "address query",
          .type = "UNS32",
          .length = 8,
          .exchange = [kind](const Context& at, ads::BytesView in) -> ads::Result<ads::Bytes> {
            ads::ByteReader reader(in);
            const std::uint32_t channel = reader.u32();
            const std::uint32_t axis = reader.u32();
            if (!reader.exact()) {
              return tl::unexpected(ads::ErrorCode::invalid_size);
            }
            if (!exists(at.machine, kind, channel, axis)) {
              return ads::ByteWriter().u32(0).u32(0).take();
            }
            const Group group{kind, Attribute::value, channel};
            return ads::ByteWriter().u32(group.number()).u32(axis << axis_shift).take();
          }};
}

}  // namespace millrace::cnc::simulator::objects
