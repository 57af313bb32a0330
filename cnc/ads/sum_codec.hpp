// Sums of ReadWrites (index group 0xF082) and of Reads (0xF080) for clients: one request in place
// of many.
//
//   auto bytes = co_await client.read_write(port, sum_index(items), sum_length(items),
//                                           encode_sum(items));
//   auto answers = decode_sum(*bytes, items);             // one Result for each item
#pragma once

#include <vector>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

/// Reads have no data, and each has a slot of its length in the response, whatever its result.
enum class SumOf : std::uint8_t { read_writes, reads };

struct SumItem {
  Index index;
  /// At most this many bytes are returned.
  std::uint32_t read_length = 0;
  Bytes data{};
};

Index sum_index(const std::vector<SumItem>& items, SumOf kind = SumOf::read_writes);
/// The data of the request.
Bytes encode_sum(const std::vector<SumItem>& items, SumOf kind = SumOf::read_writes);
/// The longest possible response, in bytes.
std::uint32_t sum_length(const std::vector<SumItem>& items, SumOf kind = SumOf::read_writes);
/// The result of each item; protocol_error if the lengths of the response are inconsistent.
Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumItem>& items,
                                              SumOf kind = SumOf::read_writes);

/// The error of a whole sum from a controller that has no sums: ask for each item alone.
bool refuses_sums(ErrorCode code);

}  // namespace millrace::cnc::ads
