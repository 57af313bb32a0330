// The device that an ADS server serves: one object that answers requests, without sockets.
//
// The server decodes frames and calls a Device; the virtual CNC implements one. Calls come one at a
// time, in the order of arrival on each connection, each frame exactly once.
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "cnc/ads/address.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/error.hpp"

namespace millrace::cnc::ads {

/// Either a value or the ADS error code that goes on the wire.
template <typename T>
using Result = tl::expected<T, ErrorCode>;

/// Response to ReadDeviceInfo; the name has at most 16 bytes.
struct DeviceInfo {
  std::uint8_t major = 0;
  std::uint8_t minor = 0;
  std::uint16_t build = 0;
  std::string name;
};

/// Response to ReadState: ADS state (5 = run, 6 = stop, 15 = config …) and device state.
struct DeviceState {
  std::uint16_t ads = 0;
  std::uint16_t device = 0;
};

/// The services behind the AMS ports of one NetId.
class Device {
 public:
  virtual ~Device() = default;

  /// False for an AMS port without a service: the server answers the frame with AMS error 6.
  [[nodiscard]] virtual bool has_port(std::uint16_t port) const = 0;
  virtual Result<DeviceInfo> info(std::uint16_t port) = 0;
  virtual Result<DeviceState> state(std::uint16_t port) = 0;
  virtual Result<void> write_control(std::uint16_t port, DeviceState wanted, BytesView data) = 0;
  /// Returns at most `length` bytes; the client sets this bound, which may be 0xFFFFFFFF.
  virtual Result<Bytes> read(std::uint16_t port, Index index, std::uint32_t length) = 0;
  virtual Result<void> write(std::uint16_t port, Index index, BytesView data) = 0;
  virtual Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                                   BytesView data) = 0;
};

// A Device that forwards every request to another one. Decorators derive from it and override what
// they add.

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
