// The virtual CNC behind an ADS server: the response of each AMS port, index group and offset.
//
//   VirtualDevice device(machine);
//   device.read_write(552, {0x122301, 0x48}, 256, name);
//
// Errors are those of the kernel's own access functions (ISG/402275851, documented; that they are
// sent on the wire is inferred): 0x702 group or channel, 0x703 offset, 0x704 not readable or
// writable, 0x705 a buffer too small or a value of the wrong size, 0x706 invalid data.
#pragma once

#include <cstdint>

#include "cnc/ads/device.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/catalogue.hpp"

namespace millrace::cnc::simulator {

class VirtualDevice : public ads::Device {
 public:
  /// The machine must outlive the device.
  explicit VirtualDevice(Machine& machine);

  [[nodiscard]] const objects::Catalogue& catalogue() const { return catalogue_; }

  [[nodiscard]] bool has_port(std::uint16_t port) const override;
  ads::Result<ads::DeviceInfo> info(std::uint16_t port) override;
  ads::Result<ads::DeviceState> state(std::uint16_t port) override;
  ads::Result<void> write_control(std::uint16_t port, ads::DeviceState wanted,
                                  ads::BytesView data) override;
  ads::Result<ads::Bytes> read(std::uint16_t port, ads::Index index, std::uint32_t length) override;
  ads::Result<void> write(std::uint16_t port, ads::Index index, ads::BytesView data) override;
  ads::Result<ads::Bytes> read_write(std::uint16_t port, ads::Index index,
                                     std::uint32_t read_length, ads::BytesView data) override;

 private:
  Machine& machine_;
  objects::Catalogue catalogue_;
};

}  // namespace millrace::cnc::simulator
