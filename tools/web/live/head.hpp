// The header of an answer, as bytes. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

struct AnswerHead {
  bool keep_alive = true;
  /// Not for HEAD.
  bool with_body = true;
  std::uint64_t length = 0;
  /// As long as the connection: no length.
  bool is_endless = false;
};

/// With what keeps a page to itself: nothing from elsewhere is loaded or run, nobody frames it.
std::string head_text(const http::Response& response, const AnswerHead& head);

/// The value of Content-Disposition for a file of any name (RFC 6266).
std::string attachment_header(std::string_view name);

}  // namespace millrace::tools::web::live
