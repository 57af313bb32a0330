// How a value of a controller is read, once it is known what it is and where (readings.hpp finds
// out). Pure.
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
  /// At most so many bytes are answered.
  std::uint32_t length = 0;
  /// What goes with the question; empty where it is a plain Read.
  Bytes input;
  ElementType type;
  bool is_array = false;
  Access access = Access::read_only;
  /// Of the whole of it: bytes, and elements in each dimension; none = a scalar.
  std::uint32_t size = 0;
  std::vector<std::uint32_t> dimensions;
};

/// Why it is not known how something is read.
struct Trouble {
  ads::ErrorCode code = ads::ErrorCode::none;
  /// For people: the error, or what is wrong with the answer.
  std::string reason;
};

}  // namespace millrace::cnc::variables
