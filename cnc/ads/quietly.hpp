// How the coroutines of this room await: an error is a value, no exception.
//
//   const auto [error, size] = co_await stream.async_read_some(buffer, quietly);
#pragma once

#include <cstddef>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace millrace::cnc::ads {

inline constexpr auto quietly = boost::asio::as_tuple(boost::asio::use_awaitable);

/// What is read from a socket at once, in bytes.
inline constexpr std::size_t chunk_size = 16384;

}  // namespace millrace::cnc::ads
