#include "cnc/variables/directory.hpp"

#include <algorithm>

namespace millrace::cnc::variables {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

namespace {

/// The index group of COM's objects, with the bits that select its directory.
constexpr std::uint32_t directory_group = 0x130100;

}  // namespace

asio::awaitable<Result<std::vector<DirectoryEntry>>> read_directory(ads::Client& client,
                                                                    std::uint32_t channel) {
  constexpr std::uint32_t most = 10'000;
  constexpr std::uint32_t at_once = 32;
  const std::uint32_t group = directory_group + channel;
  const ads::Index head{group, 0};
  const auto counted = co_await client.read(com_port, head, 4);
  if (!counted) {
    co_return tl::make_unexpected(counted.error());
  }
  ads::ByteReader in(*counted);
  const std::uint32_t count = in.u32();
  if (!in.exact() || count > most) {
    co_return tl::make_unexpected(ErrorCode::protocol_error);
  }
  std::vector<DirectoryEntry> entries;
  while (entries.size() < count) {
    const auto next = static_cast<std::uint32_t>(entries.size());
    const ads::Index place{group, next + 1};
    const auto length =
        static_cast<std::uint32_t>(std::min(at_once, count - next) * directory_record);
    const auto records = co_await client.read(com_port, place, length);
    if (!records) {
      co_return tl::make_unexpected(records.error());
    }
    BytesView rest(*records);
    if (rest.size() < directory_record) {
      co_return tl::make_unexpected(ErrorCode::protocol_error);
    }
    while (const auto entry = decode_directory_record(rest)) {
      entries.push_back(*entry);
      rest = rest.subspan(directory_record);
    }
  }
  co_return entries;
}

}  // namespace millrace::cnc::variables
