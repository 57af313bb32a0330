// HTTP transfers of one thread, by libcurl's multi interface.
//
//   Transfers transfers;
//   const auto id = transfers.start({.endpoint = endpoint, .url = endpoint->url, .post = post}, done);
//   for (;;) transfers.run(100ms);        // calls `done`
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/http/message.hpp"

namespace millrace::services::http {

struct Transfer {
  /// Its secrets and proxy are used.
  std::shared_ptr<const Endpoint> endpoint;
  std::string url{};
  /// Nothing: a GET, or `connect_only`.
  std::optional<Post> post{};
  /// Only connects, with TLS for https.
  bool connect_only = false;
  std::chrono::milliseconds limit{};
};

/// All functions but wake() are for one thread.
class Transfers {
 public:
  using Id = std::uint64_t;
  using Done = std::function<void(const Exchange&)>;

  /// Throws std::runtime_error if libcurl cannot be used.
  Transfers();
  /// Ends all transfers.
  ~Transfers();
  Transfers(const Transfers&) = delete;
  Transfers& operator=(const Transfers&) = delete;

  /// The request of a service with delivery at most once is never sent twice, nor is a redirect
  /// followed.
  Id start(Transfer transfer, Done done);
  /// Closes its connection; its `done` is not called.
  void cancel(Id id);
  /// Transfers until one has ended, `limit` is over or wake() is called.
  void run(std::chrono::milliseconds limit);
  /// Ends run(). From any thread.
  void wake();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::http
