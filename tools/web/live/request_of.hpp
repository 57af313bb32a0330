// Converts a message of Boost.Beast for the site. Pure.
#pragma once

#include <string>

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

using Message = boost::beast::http::request<boost::beast::http::string_body>;

/// `peer`: address of the client.
http::Request request_of(const Message& message, const std::string& peer);

}  // namespace millrace::tools::web::live
