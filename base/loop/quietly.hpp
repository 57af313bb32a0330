// Completion token for coroutines of Boost.Asio: an error is a value, not an exception.
//
//   const auto [error, size] = co_await stream.async_read_some(buffer, quietly);
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace millrace::base::loop {

inline constexpr auto quietly = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace millrace::base::loop
