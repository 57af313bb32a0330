// A Device for tests: bytes at indexes, on AMS port 552.
#pragma once

#include <algorithm>
#include <map>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

class MemoryDevice : public Device {
 public:
  /// The value at each index; an index without one is an invalid group.
  std::map<Index, Bytes> values;
  /// Requests that reached the device.
  int calls = 0;

  [[nodiscard]] bool has_port(std::uint16_t port) const override { return port == 552; }
  Result<DeviceInfo> info(std::uint16_t) override {
    ++calls;
    return DeviceInfo{3, 1, 4024, "memory"};
  }
  Result<DeviceState> state(std::uint16_t) override {
    ++calls;
    return state_;
  }
  Result<void> write_control(std::uint16_t, DeviceState wanted, BytesView) override {
    ++calls;
    state_ = wanted;
    return {};
  }
  Result<Bytes> read(std::uint16_t, Index index, std::uint32_t length) override {
    ++calls;
    const auto found = values.find(index);
    if (found == values.end()) {
      return tl::make_unexpected(ErrorCode::invalid_group);
    }
    Bytes value = found->second;
    value.resize(std::min<std::size_t>(value.size(), length));
    return value;
  }
  Result<void> write(std::uint16_t, Index index, BytesView data) override {
    ++calls;
    if (!values.contains(index)) {
      return tl::make_unexpected(ErrorCode::invalid_group);
    }
    values[index].assign(data.begin(), data.end());
    return {};
  }
  /// Returns the old value and stores the new one.
  Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                           BytesView data) override {
    const auto old = read(port, index, read_length);
    if (old) {
      values[index].assign(data.begin(), data.end());
    }
    return old;
  }

 private:
  DeviceState state_{5, 0};
};

}  // namespace millrace::cnc::ads
