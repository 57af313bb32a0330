// Sums of ReadWrites (index group 0xF082) and of Reads (0xF080) from the client's side: one request
// instead of many.
//
//   auto request = encode_sum(items);
//   auto bytes = co_await client.read_write(port, {sum::read_write, count}, sum_length(items),
//   request); auto answers = decode_sum(*bytes, items);             // one Result for each item
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

/// What is written to the controller.
Bytes encode_sum(const std::vector<SumItem>& items);
/// The longest answer.
std::uint32_t sum_length(const std::vector<SumItem>& items);
/// The answer to each item; protocol_error if its lengths do not fit together.
Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumItem>& items);

/// A Read in a sum of them. Its slot in the answer has this length, whatever comes of it.
struct SumRead {
  Index index;
  std::uint32_t length = 0;
};

/// The same three for a sum of Reads.
Bytes encode_sum(const std::vector<SumRead>& items);
std::uint32_t sum_length(const std::vector<SumRead>& items);
Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumRead>& items);

}  // namespace millrace::cnc::ads
