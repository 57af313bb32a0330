// How the coroutines of this room await: an error is a value, no exception.
//
//   const auto [error, size] = co_await stream.async_read_some(buffer, quietly);
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace millrace::tools::web::live {

inline constexpr auto quietly = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace millrace::tools::web::live
