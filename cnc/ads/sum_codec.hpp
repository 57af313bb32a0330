// Sums of ReadWrites (index group 0xF082) and of Reads (0xF080) for clients: one request in place
// of many.
//
//   auto request = encode_sum(items);
//   auto bytes = co_await client.read_write(port, {sum::read_write, count}, sum_length(items),
//                                           request);
//   auto answers = decode_sum(*bytes, items);             // one Result for each item
#pragma once

#include <vector>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

struct SumItem {
  Index index;
  /// At most this many bytes are returned.
  std::uint32_t read_length = 0;
  Bytes data;
};

/// The data of the request.
Bytes encode_sum(const std::vector<SumItem>& items);
/// The longest possible response, in bytes.
std::uint32_t sum_length(const std::vector<SumItem>& items);
/// The result of each item; protocol_error if the lengths of the response are inconsistent.
Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumItem>& items);

/// A Read in a sum. Its slot in the response has this length, whatever its result.
struct SumRead {
  Index index;
  std::uint32_t length = 0;
};

/// The same three functions for a sum of Reads.
Bytes encode_sum(const std::vector<SumRead>& items);
std::uint32_t sum_length(const std::vector<SumRead>& items);
Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumRead>& items);

}  // namespace millrace::cnc::ads
