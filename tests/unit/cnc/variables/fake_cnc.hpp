// A controller for tests: the variables of some channels, with switches for the differences between
// real ones.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

class FakeCnc : public ads::Device {
 public:
  std::uint32_t channels = 1;
  std::uint32_t group = decoder_group;
  /// By name, in every channel.
  std::map<std::string, Bytes> values;
  ads::ErrorCode unknown_name = ads::ErrorCode::symbol_not_found;
  bool knows_handles = true;
  /// As on newer controllers.
  bool describes_by_name = true;
  /// Changes all handles, like a restart.
  std::uint32_t handle_base = 0x01020000;
  /// The response to every request.
  ads::ErrorCode failure = ads::ErrorCode::none;
  /// Index offsets of the received requests, in order.
  std::vector<std::uint32_t> calls;

  [[nodiscard]] bool has_port(std::uint16_t port) const override { return port == sda_port; }
  ads::Result<ads::DeviceInfo> info(std::uint16_t) override { return ads::DeviceInfo{}; }
  ads::Result<ads::DeviceState> state(std::uint16_t) override { return ads::DeviceState{5, 0}; }
  ads::Result<void> write_control(std::uint16_t, ads::DeviceState, BytesView) override {
    return {};
  }
  ads::Result<Bytes> read(std::uint16_t, ads::Index, std::uint32_t) override {
    return tl::make_unexpected(ads::ErrorCode::service_not_supported);
  }
  ads::Result<void> write(std::uint16_t, ads::Index index, BytesView data) override {
    if (const auto error = check(index); error != ads::ErrorCode::none) {
      return tl::make_unexpected(error);
    }
    const auto [name, value] = target(index.offset, data);
    const auto found = values.find(name);
    if (found == values.end()) {
      return tl::make_unexpected(unknown_name);
    }
    found->second.assign(value.begin(), value.end());
    return {};
  }
  ads::Result<Bytes> read_write(std::uint16_t, ads::Index index, std::uint32_t read_length,
                                BytesView data) override {
    if (const auto error = check(index); error != ads::ErrorCode::none) {
      return tl::make_unexpected(error);
    }
    if (index.offset == offset::count) {
      return ads::ByteWriter().u32(static_cast<std::uint32_t>(values.size())).take();
    }
    if (index.offset == offset::description_by_index) {
      return describe(decode_index_stream(data)->index);
    }
    const auto name = target(index.offset, data).first;
    const auto found = values.find(name);
    if (found == values.end()) {
      return tl::make_unexpected(unknown_name);
    }
    const auto handle =
        handle_base + static_cast<std::uint32_t>(std::distance(values.begin(), found));
    if (index.offset == offset::handle_by_name) {
      return ads::ByteWriter().u32(handle).take();
    }
    if (index.offset == offset::description_by_name) {
      const auto size = static_cast<std::uint32_t>(found->second.size());
      return encode(Description{handle, Type::uns32, Access::read_write, size, {}, {}},
                    NameInDescription::no);
    }
    if (found->second.size() > read_length) {
      return tl::make_unexpected(ads::ErrorCode::invalid_size);
    }
    return found->second;
  }

 private:
  ads::ErrorCode check(ads::Index index) {
    calls.push_back(index.offset);
    if (failure != ads::ErrorCode::none) {
      return failure;
    }
    if (index.group <= group || index.group > group + channels) {
      return ads::ErrorCode::invalid_group;
    }
    const bool by_handle = index.offset == offset::handle_by_name ||
                           index.offset == offset::read_by_handle ||
                           index.offset == offset::write_by_handle;
    const bool unknown = (by_handle && !knows_handles) ||
                         (index.offset == offset::description_by_name && !describes_by_name);
    return unknown ? ads::ErrorCode::invalid_offset : ads::ErrorCode::none;
  }
  [[nodiscard]] ads::Result<Bytes> describe(std::uint32_t number) const {
    if (number >= values.size()) {
      return tl::make_unexpected(ads::ErrorCode::invalid_data);
    }
    const auto& [name, value] = *std::next(values.begin(), number);
    const auto size = static_cast<std::uint32_t>(value.size());
    return encode(
        Description{handle_base + number, Type::uns32, Access::read_write, size, {}, name},
        NameInDescription::yes);
  }
  [[nodiscard]] std::pair<std::string, BytesView> target(std::uint32_t function,
                                                         BytesView data) const {
    if (function != offset::read_by_handle && function != offset::write_by_handle) {
      const auto stream = decode_name(data);
      return {std::string(stream->name), stream->value};
    }
    const auto stream = decode_handle_stream(data);
    const auto place = stream->element.handle - handle_base;
    if (place >= values.size()) {
      return {"no such handle", {}};
    }
    return {std::next(values.begin(), place)->first, stream->value};
  }
};

}  // namespace millrace::cnc::variables
