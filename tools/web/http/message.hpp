// A browser's request and its response, without sockets. Pure values.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <boost/json/object.hpp>

#include "base/posix/system.hpp"

namespace millrace::tools::web::http {

/// The parts of a request that are used. Missing header fields are empty.
struct Request {
  std::string method = "GET";
  /// As sent: "/api/calls?failed=1".
  std::string target = "/";
  /// If a request has several, which no browser sends, all of them.
  std::string host{};
  std::string origin{};
  /// Sec-Fetch-Site: the browser's statement about the origin of the request.
  std::string fetch_site{};
  std::string content_type{};
  std::string cookie{};
  /// X-Millrace-Token.
  std::string token{};
  std::string accept_encoding{};
  std::string if_none_match{};
  std::string body{};
  /// Address of the client, for the log.
  std::string peer{};
};

struct Response {
  unsigned status = 200;
  std::string content_type = "application/json";
  /// Shared, so that files of the page are not copied for each browser.
  std::shared_ptr<const std::string> body = std::make_shared<std::string>();
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// The connection stays open for the stream of changes.
struct StreamLive {};

struct Download {
  base::posix::Fd file{};
  std::uint64_t size = 0;
  std::string name{};
};

/// Threads beside the loop, one each and several for calls of services, so that they do not wait
/// for each other.
enum class WorkerKind : std::uint8_t { recordings, operators, doctor, calls };

/// Work that would block the loop. `work` runs in the thread of its worker; its result runs on the
/// loop.
struct Later {
  WorkerKind worker = WorkerKind::recordings;
  std::function<std::function<Response()>()> work{};
};

using Outcome = std::variant<Response, StreamLive, Download, Later>;

Response json_response(const boost::json::value& value, unsigned status = 200);
/// {"error": what}. `what` names the problem and what to do.
Response error_response(unsigned status, std::string_view what);

/// Parses a JSON object; nothing if `body` is none.
std::optional<boost::json::object> object_in(std::string_view body);
/// A text of an object; nothing if it has none of this name.
std::optional<std::string> text_in(const boost::json::object& object, const char* name);

// Parses the target of a request. Pure; its input is untrusted.
//
//   parse_target("/api/calls/5f-17?limit=20")  →  {"api", "calls", "5f-17"}, limit = "20"

struct Target {
  /// Decoded names: never empty, ".", "..", or with '/' or NUL.
  std::vector<std::string> path{};
  /// Decoded; all values of each name, in their order.
  std::map<std::string, std::vector<std::string>> query{};

  /// The value, or an empty text. If a name occurs twice, the last value counts.
  [[nodiscard]] std::string value(const std::string& name) const;
  /// All values of the name.
  [[nodiscard]] std::vector<std::string> values(const std::string& name) const;
};

/// Nothing if it is not an absolute path, or if its names are ambiguous.
std::optional<Target> parse_target(std::string_view text);

}  // namespace millrace::tools::web::http
