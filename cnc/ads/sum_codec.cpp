#include "cnc/ads/sum_codec.hpp"

namespace millrace::cnc::ads {
namespace {

// Result and returned length of one item.
constexpr std::uint32_t result_size = 8;
// The result alone, of a Read.
constexpr std::uint32_t code_size = 4;

}  // namespace

Bytes encode_sum(const std::vector<SumItem>& items) {
  ByteWriter out;
  for (const auto& item : items) {
    out.u32(item.index.group).u32(item.index.offset).u32(item.read_length);
    out.u32(static_cast<std::uint32_t>(item.data.size()));
  }
  for (const auto& item : items) {
    out.bytes(item.data);
  }
  return out.take();
}

std::uint32_t sum_length(const std::vector<SumItem>& items) {
  std::uint32_t length = 0;
  for (const auto& item : items) {
    length += result_size + item.read_length;
  }
  return length;
}

Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumItem>& items) {
  const auto protocol_error = tl::make_unexpected(ErrorCode::protocol_error);
  ByteReader results(answer);
  ByteReader data(answer);
  data.take(items.size() * result_size);
  std::vector<Result<Bytes>> answers;
  answers.reserve(items.size());
  for (const auto& item : items) {
    const auto code = from_wire(results.u32());
    const auto length = results.u32();
    const auto bytes = data.take(length);
    if (length > item.read_length) {
      return protocol_error;
    }
    if (code == ErrorCode::none) {
      answers.emplace_back(Bytes(bytes.begin(), bytes.end()));
    } else {
      answers.emplace_back(tl::make_unexpected(code));
    }
  }
  if (!results.ok() || !data.ok()) {
    return protocol_error;
  }
  return answers;
}

Bytes encode_sum(const std::vector<SumRead>& items) {
  ByteWriter out;
  for (const auto& item : items) {
    out.u32(item.index.group).u32(item.index.offset).u32(item.length);
  }
  return out.take();
}

std::uint32_t sum_length(const std::vector<SumRead>& items) {
  std::uint32_t length = 0;
  for (const auto& item : items) {
    length += code_size + item.length;
  }
  return length;
}

Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumRead>& items) {
  ByteReader codes(answer);
  ByteReader data(answer);
  data.take(items.size() * code_size);
  std::vector<Result<Bytes>> answers;
  answers.reserve(items.size());
  for (const auto& item : items) {
    const auto code = from_wire(codes.u32());
    const auto bytes = data.take(item.length);
    if (code == ErrorCode::none) {
      answers.emplace_back(Bytes(bytes.begin(), bytes.end()));
    } else {
      answers.emplace_back(tl::make_unexpected(code));
    }
  }
  if (!codes.ok() || !data.ok()) {
    return tl::make_unexpected(ErrorCode::protocol_error);
  }
  return answers;
}

}  // namespace millrace::cnc::ads
