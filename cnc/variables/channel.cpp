#include "cnc/variables/channel.hpp"

#include "cnc/ads/sum_commands.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

// Decodes a number of 4 bytes; any other size is a protocol_error.
Result<std::uint32_t> decode_number(const Bytes& bytes) {
  ads::ByteReader in(bytes);
  const auto number = in.u32();
  if (!in.exact()) {
    return tl::make_unexpected(ErrorCode::protocol_error);
  }
  return number;
}

Result<Description> decode_answer(const Bytes& bytes) {
  auto description = decode_description(bytes);
  if (!description) {
    return tl::make_unexpected(ErrorCode::protocol_error);
  }
  return std::move(*description);
}

asio::awaitable<Result<std::uint32_t>> as_number(asio::awaitable<Result<Bytes>> answer) {
  const auto bytes = co_await std::move(answer);
  co_return bytes.and_then(decode_number);
}

asio::awaitable<Result<Description>> as_description(asio::awaitable<Result<Bytes>> answer) {
  const auto bytes = co_await std::move(answer);
  co_return bytes.and_then(decode_answer);
}

asio::awaitable<Result<std::string>> as_text(asio::awaitable<Result<Bytes>> answer) {
  const auto bytes = co_await std::move(answer);
  co_return bytes.map([](const Bytes& text) { return decode_text(text); });
}

asio::awaitable<Result<std::vector<Result<Bytes>>>> as_answers(
    asio::awaitable<Result<Bytes>> answer, std::vector<ads::SumItem> items) {
  const auto bytes = co_await std::move(answer);
  co_return bytes.and_then([&items](const Bytes& sum) { return ads::decode_sum(sum, items); });
}

}  // namespace

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
  constexpr std::uint32_t size = 4;
  return as_number(client_.read_write(port_, at(offset::handle_by_name), size, encode_name(name)));
}

asio::awaitable<Result<Description>> Channel::describe(std::string_view name) {
  constexpr std::uint32_t size = max_stream;
  return as_description(
      client_.read_write(port_, at(offset::description_by_name), size, encode_name(name)));
}

asio::awaitable<Result<std::uint32_t>> Channel::count(std::string_view kind) {
  constexpr std::uint32_t size = 4;
  return as_number(client_.read_write(port_, at(offset::count), size, encode_name(kind)));
}

asio::awaitable<Result<Description>> Channel::describe(const IndexStream& index) {
  constexpr std::uint32_t size = max_stream;
  return as_description(
      client_.read_write(port_, at(offset::description_by_index), size, encode(index)));
}

asio::awaitable<Result<std::uint32_t>> Channel::old_count(std::uint32_t offset) {
  constexpr std::uint32_t size = 4;
  return as_number(client_.read(port_, at(offset), size));
}

asio::awaitable<Result<std::string>> Channel::old_name(std::uint32_t offset, std::uint32_t index) {
  constexpr std::uint32_t size = 96;
  return as_text(client_.read_write(port_, at(offset), size, ads::ByteWriter().u32(index).take()));
}

ads::SumItem Channel::item(std::string_view name, std::uint32_t length) const {
  return {at(offset::read_by_name), length, encode_name(name)};
}

ads::SumItem Channel::item(const ElementOf& element, std::uint32_t length) const {
  return {at(offset::read_by_handle), length, encode(element)};
}

asio::awaitable<Result<std::vector<Result<Bytes>>>> Channel::read(std::vector<ads::SumItem> items) {
  const ads::Index sum{ads::sum::read_write, static_cast<std::uint32_t>(items.size())};
  auto answer = client_.read_write(port_, sum, ads::sum_length(items), ads::encode_sum(items));
  return as_answers(std::move(answer), std::move(items));
}

}  // namespace millrace::cnc::variables
