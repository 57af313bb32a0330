#include "cnc/simulator/virtual_device.hpp"

#include <utility>

#include "cnc/simulator/objects/group.hpp"
#include "cnc/variables/addresses.hpp"

namespace millrace::cnc::simulator {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;
using objects::Attribute;
using objects::Target;

constexpr std::uint16_t ads_state_run = 5;
/// The system service of TwinCAT, whose state clients read first.
constexpr std::uint16_t system_port = 10000;
/// ReadState as a value for notifications: ADSIGRP_DEVICE_DATA and ADSIOFFS_DEVDATA_ADSSTATE of
/// Beckhoff's TcAdsDef.h (documented).
constexpr ads::Index state_value{0xF100, 0};

/// 0x705 if the buffer is too small (documented).
Result<Bytes> fit(Bytes answer, std::uint32_t room) {
  return answer.size() > room ? tl::unexpected(ErrorCode::invalid_size)
                              : Result<Bytes>(std::move(answer));
}

Result<Bytes> read_target(const Target& target) {
  if (target.attribute == Attribute::value) {
    return target.object->read ? target.object->read(target.at)
                               : tl::unexpected(ErrorCode::access_denied_index);
  }
  return target.attribute == Attribute::address
             ? tl::unexpected(ErrorCode::access_denied_index)
             : Result<Bytes>(objects::attribute_of(*target.object, target.attribute));
}

Result<Bytes> exchange_target(const Target& target, BytesView data) {
  const bool possible =
      target.attribute == Attribute::value || target.attribute == Attribute::address;
  return possible && target.object->exchange ? target.object->exchange(target.at, data)
                                             : tl::unexpected(ErrorCode::access_denied_index);
}

}  // namespace

VirtualDevice::VirtualDevice(Machine& machine) : machine_(machine) {}

bool VirtualDevice::has_port(std::uint16_t port) const {
  return port == objects::geo_port || port == variables::sda_port || port == objects::com_port ||
         port == system_port;
}

Result<ads::DeviceInfo> VirtualDevice::info(std::uint16_t port) {
  return ads::DeviceInfo{0, 1, 0, port == system_port ? "millrace System" : "millrace CNC"};
}

Result<ads::DeviceState> VirtualDevice::state(std::uint16_t /*port*/) {
  return ads::DeviceState{ads_state_run, 0};
}

Result<void> VirtualDevice::write_control(std::uint16_t /*port*/, ads::DeviceState /*wanted*/,
                                          BytesView /*data*/) {
  return tl::unexpected(ErrorCode::service_not_supported);
}

Result<Bytes> VirtualDevice::read(std::uint16_t port, ads::Index index, std::uint32_t length) {
  if (index == state_value) {
    const ads::DeviceState now = *state(port);
    return fit(ads::ByteWriter().u16(now.ads).u16(now.device).take(), length);
  }
  machine_.apply_writes();
  return catalogue_.find(machine_, port, index, length)
      .and_then([](const Target& target) { return read_target(target); })
      .and_then([&](Bytes&& answer) { return fit(std::move(answer), length); });
}

Result<void> VirtualDevice::write(std::uint16_t port, ads::Index index, BytesView data) {
  machine_.apply_writes();
  return catalogue_.find(machine_, port, index, 0).and_then([&](const Target& target) {
    return target.attribute == Attribute::value && target.object->write
               ? target.object->write(target.at, data)
               : tl::unexpected(ErrorCode::access_denied_index);
  });
}

Result<Bytes> VirtualDevice::read_write(std::uint16_t port, ads::Index index,
                                        std::uint32_t read_length, BytesView data) {
  machine_.apply_writes();
  return catalogue_.find(machine_, port, index, read_length)
      .and_then([&](const Target& target) { return exchange_target(target, data); })
      .and_then([&](Bytes&& answer) { return fit(std::move(answer), read_length); });
}

}  // namespace millrace::cnc::simulator
