// A request and the header of a response, between Boost.Beast and the site. Pure.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

// The header of a response, as bytes. Pure.

struct AnswerHead {
  bool keep_alive = true;
  /// False for HEAD.
  bool with_body = true;
  std::uint64_t length = 0;
  /// Ends with the connection: no length.
  bool is_endless = false;
};

/// With header fields that protect the page: no foreign content, no scripts, no frames.
std::string head_text(const http::Response& response, const AnswerHead& head);

/// The value of Content-Disposition for a file of any name (RFC 6266).
std::string attachment_header(std::string_view name);

// Converts a message of Boost.Beast for the site. Pure.

using Message = boost::beast::http::request<boost::beast::http::string_body>;

/// `peer`: address of the client.
http::Request request_of(const Message& message, const std::string& peer);

/// The client of a request that `peer` sent: behind a trusted proxy the last address of
/// X-Forwarded-For that is not one. What any other client says in that header does not count.
std::string client_of(const Message& message, const std::string& peer,
                      const std::set<std::string>& trusted_proxies);

/// Whether the length of its body is known: no Transfer-Encoding but "chunked" (RFC 9112, 6.1).
/// Otherwise its body would be read as the next request.
bool has_known_length(const Message& message);

}  // namespace millrace::tools::web::live
