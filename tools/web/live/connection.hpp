// A connection of a browser: requests and responses, one at a time.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>

#include "base/program/log.hpp"
#include "tools/web/http/site.hpp"
#include "tools/web/live/feed.hpp"
#include "tools/web/live/server.hpp"
#include "tools/web/live/workers.hpp"

namespace millrace::tools::web::live {

/// What the connections of a server share.
struct Shared {
  const http::Site& site;
  const ServerOptions& options;
  Workers& workers;
  Feeds& feeds;
  ServerCounts& counts;
  std::function<std::string()>& greeting;
  base::program::Log log;
};

class Connection {
 public:
  virtual ~Connection() = default;

  /// Runs until either side closes.
  virtual boost::asio::awaitable<void> run() = 0;
  /// Called on the loop: ends all pending operations.
  virtual void close() = 0;
  /// Since when it has waited for a whole request; nothing while one is handled.
  [[nodiscard]] virtual std::optional<std::chrono::steady_clock::time_point> idle_since() const = 0;
  /// Of the other side, in text.
  [[nodiscard]] virtual const std::string& peer() const = 0;
};

/// `tls` may be null: plain HTTP. `shared` and `tls` outlive it.
std::shared_ptr<Connection> make_connection(boost::asio::ip::tcp::socket socket,
                                            boost::asio::ssl::context* tls, Shared& shared);

}  // namespace millrace::tools::web::live
