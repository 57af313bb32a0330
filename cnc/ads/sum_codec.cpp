#include "cnc/ads/sum_codec.hpp"

#include "cnc/ads/sum_commands.hpp"

namespace millrace::cnc::ads {
namespace {

// Bytes before the data of an item: its result, and the returned length of a ReadWrite.
std::uint32_t result_size(SumOf kind) {
  return kind == SumOf::reads ? 4 : 8;
}

}  // namespace

Index sum_index(const std::vector<SumItem>& items, SumOf kind) {
  return {kind == SumOf::reads ? sum::read : sum::read_write,
          static_cast<std::uint32_t>(items.size())};
}

Bytes encode_sum(const std::vector<SumItem>& items, SumOf kind) {
  ByteWriter out;
  for (const auto& item : items) {
    out.u32(item.index.group).u32(item.index.offset).u32(item.read_length);
    if (kind == SumOf::read_writes) {
      out.u32(static_cast<std::uint32_t>(item.data.size()));
    }
  }
  for (const auto& item : items) {
    out.bytes(item.data);
  }
  return out.take();
}

std::uint32_t sum_length(const std::vector<SumItem>& items, SumOf kind) {
  std::uint32_t length = 0;
  for (const auto& item : items) {
    length += result_size(kind) + item.read_length;
  }
  return length;
}

Result<std::vector<Result<Bytes>>> decode_sum(BytesView answer, const std::vector<SumItem>& items,
                                              SumOf kind) {
  const auto protocol_error = tl::make_unexpected(ErrorCode::protocol_error);
  ByteReader results(answer);
  ByteReader data(answer);
  data.take(items.size() * result_size(kind));
  std::vector<Result<Bytes>> answers;
  answers.reserve(items.size());
  for (const auto& item : items) {
    const auto code = from_wire(results.u32());
    const auto length = kind == SumOf::reads ? item.read_length : results.u32();
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

bool refuses_sums(ErrorCode code) {
  return is_refusal(code) || code == ErrorCode::protocol_error;
}

}  // namespace millrace::cnc::ads
