#include "cnc/variables/channel.hpp"

#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

namespace asio = boost::asio;
using ads::Result;

asio::awaitable<Result<Bytes>> Channel::read(std::string_view name, std::uint32_t length) {
  return client_.read_write(port_, at(offset::read_by_name), length, encode_name(name));
}

asio::awaitable<Result<Bytes>> Channel::read(const ElementOf& element, std::uint32_t length) {
  return client_.read_write(port_, at(offset::read_by_handle), length, encode(element));
}

asio::awaitable<Result<void>> Channel::write(std::string_view name, BytesView value) {
  return client_.write(port_, at(offset::write_by_name), encode_name(name, value));
}

asio::awaitable<Result<void>> Channel::write(const ElementOf& element, BytesView value) {
  return client_.write(port_, at(offset::write_by_handle), encode(element, value));
}

asio::awaitable<Result<std::uint32_t>> Channel::handle(std::string_view name) {
  Bytes input = encode_name(name);
  const auto bytes =
      co_await client_.read_write(port_, at(offset::handle_by_name), 4, std::move(input));
  co_return bytes.and_then(decode_number);
}

ads::SumItem Channel::item(std::string_view name, std::uint32_t length) const {
  return {at(offset::read_by_name), length, encode_name(name)};
}

ads::SumItem Channel::item(const ElementOf& element, std::uint32_t length) const {
  return {at(offset::read_by_handle), length, encode(element)};
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
