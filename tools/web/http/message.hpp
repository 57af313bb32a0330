// A request of a browser and what is answered to it, without sockets. Pure values.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <boost/json/value.hpp>

#include "base/posix/fd.hpp"

namespace millrace::tools::web::http {

/// What of a request counts here. Header fields that are not there are empty.
struct Request {
  std::string method = "GET";
  /// As it was sent: "/api/calls?failed=1".
  std::string target = "/";
  /// Of a request with several, which no browser sends, all of them.
  std::string host{};
  std::string origin{};
  /// Sec-Fetch-Site: what the browser says of who asks.
  std::string fetch_site{};
  std::string content_type{};
  std::string cookie{};
  /// X-Millrace-Token.
  std::string token{};
  std::string accept_encoding{};
  std::string if_none_match{};
  std::string body{};
  /// Address of who asks, for the log.
  std::string peer{};
};

struct Response {
  unsigned status = 200;
  std::string content_type = "application/json";
  /// Shared, so that a file of the page is not copied for each browser.
  std::shared_ptr<const std::string> body = std::make_shared<std::string>();
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// The browser stays, and is told what changes.
struct StreamLive {};

/// The whole of a file.
struct Download {
  base::posix::Fd file{};
  std::uint64_t size = 0;
  std::string name{};
};

/// Threads beside the loop, one each: what waits in one does not wait for what the others do.
enum class WorkerKind : std::uint8_t { recordings, operators, doctor };

/// What would hold up the loop. `work` runs in the thread of its worker, what it returns on the
/// loop.
struct Later {
  WorkerKind worker = WorkerKind::recordings;
  std::function<std::function<Response()>()> work{};
};

using Outcome = std::variant<Response, StreamLive, Download, Later>;

Response json_response(const boost::json::value& value, unsigned status = 200);
/// {"error": what}. `what` says what happened and what to do.
Response error_response(unsigned status, std::string_view what);

}  // namespace millrace::tools::web::http
