#include "cnc/variables/service_interface.hpp"

namespace millrace::cnc::variables {

namespace asio = boost::asio;
using ads::Result;

asio::awaitable<Result<ServiceValue>> ServiceInterface::read(ServiceVariable variable) {
  const auto bytes = co_await channel_.read(name_of(variable), read_length(variable));
  co_return bytes.and_then(
      [variable](const Bytes& value) { return decode_value(variable, value); });
}

asio::awaitable<Result<void>> ServiceInterface::write(ServiceVariable variable,
                                                      ServiceValue value) {
  const auto bytes = encode_value(variable, value);
  if (!bytes) {
    co_return tl::make_unexpected(bytes.error());
  }
  auto written = co_await channel_.write(name_of(variable), *bytes);
  co_return written;
}

}  // namespace millrace::cnc::variables
