#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

namespace asio = boost::asio;
using ads::Result;

asio::awaitable<Result<Bytes>> Channel::read(std::string_view name, std::uint32_t length) {
  return client_.read_write(port_, at(offset::read_by_name), length, encode_name(name));
}

asio::awaitable<Result<void>> Channel::write(std::string_view name, BytesView value) {
  return client_.write(port_, at(offset::write_by_name), encode_name(name, value));
}

ads::SumItem Channel::item(std::string_view name, std::uint32_t length) const {
  return {at(offset::read_by_name), length, encode_name(name)};
}

asio::awaitable<Result<Answers>> read_together(ads::Client& client, std::uint16_t port,
                                               std::vector<ads::SumItem> items, ads::SumOf kind) {
  Bytes question = ads::encode_sum(items, kind);
  const auto answer = co_await client.read_write(port, ads::sum_index(items, kind),
                                                 ads::sum_length(items, kind), std::move(question));
  co_return answer.and_then(
      [&](const Bytes& bytes) { return ads::decode_sum(bytes, items, kind); });
}

}  // namespace millrace::cnc::variables
