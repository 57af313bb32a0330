// How to read a value of a controller whose address and type are known (readings.hpp finds them).
// Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

struct Reading {
  std::uint16_t port = sda_port;
  ads::Index index;
  /// The most bytes of the response.
  std::uint32_t length = 0;
  /// The input of a ReadWrite; empty for a plain Read.
  Bytes input;
  ElementType type;
  bool is_array = false;
  Access access = Access::read_only;
  /// Size of the whole variable in bytes, and elements in each dimension; empty = a scalar.
  std::uint32_t size = 0;
  std::vector<std::uint32_t> dimensions;
};

/// Why the address or type of a value could not be found.
struct LookupError {
  ads::ErrorCode code = ads::ErrorCode::none;
  /// For people: the error, or the fault in the response.
  std::string reason;
};

}  // namespace millrace::cnc::variables
