// A Device that forwards every request to another one. Decorators derive from it and override what
// they add.
#pragma once

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

class ForwardingDevice : public Device {
 public:
  /// The inner device must outlive this one.
  explicit ForwardingDevice(Device& inner) : inner_(inner) {}

  [[nodiscard]] bool has_port(std::uint16_t port) const override { return inner_.has_port(port); }
  Result<DeviceInfo> info(std::uint16_t port) override { return inner_.info(port); }
  Result<DeviceState> state(std::uint16_t port) override { return inner_.state(port); }
  Result<void> write_control(std::uint16_t port, DeviceState wanted, BytesView data) override {
    return inner_.write_control(port, wanted, data);
  }
  Result<Bytes> read(std::uint16_t port, Index index, std::uint32_t length) override {
    return inner_.read(port, index, length);
  }
  Result<void> write(std::uint16_t port, Index index, BytesView data) override {
    return inner_.write(port, index, data);
  }
  Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                           BytesView data) override {
    return inner_.read_write(port, index, read_length, data);
  }

 protected:
  [[nodiscard]] Device& inner() { return inner_; }

 private:
  Device& inner_;
};

}  // namespace millrace::cnc::ads
