// The requests of a client over its connections, one connection after the other. A coroutine sends
// a request and gets the response, the timeout or the end of the connection, whichever comes first.
//
//   requester->open(std::move(transport));
//   auto payload = co_await Requester::request(requester, 552, Command::read_state, Bytes());
//
// Exchange assigns responses to requests; Link moves the bytes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include <boost/asio/steady_timer.hpp>

#include "cnc/ads/client.hpp"
#include "cnc/ads/link.hpp"
#include "cnc/ads/signs_of_life.hpp"

namespace millrace::cnc::ads {

/// Not thread-safe. Pending requests keep it alive.
class Requester : public std::enable_shared_from_this<Requester> {
 public:
  Requester(boost::asio::any_io_executor executor, const ClientOptions& options);

  /// Begins a connection over this transport; none may be open.
  void open(Transport transport);
  /// Ends the connection: pending requests end with link_lost at once, not at their timeout.
  void close();
  /// A request that is sent before close(), if the socket accepts it at once. Its response is
  /// ignored.
  struct LastRequest {
    std::uint16_t port = 0;
    Command command{};
    Bytes payload;
  };
  /// Sends these requests, then calls close().
  void leave(const std::vector<LastRequest>& farewells);
  [[nodiscard]] const boost::asio::any_io_executor& executor() const { return executor_; }
  [[nodiscard]] bool is_open() const { return link_ != nullptr; }
  /// Our local address of the connection.
  [[nodiscard]] const std::string& local_address() const { return link_->local_address(); }
  /// Sets the handler for the end of a connection. It is called after the pending requests have
  /// ended, and not for close().
  void on_end(std::function<void(const LinkEnd&)> handler) { ended_ = std::move(handler); }

  /// Sets the handler of device notifications.
  void on_notification(std::function<void(const Packet&)> handler) {
    notified_ = std::move(handler);
  }

  /// The payload of the response, the error of its AMS header, or one of our own errors.
  static boost::asio::awaitable<Result<Bytes>> request(std::shared_ptr<Requester> self,
                                                       std::uint16_t port, Command command,
                                                       Bytes payload);
  [[nodiscard]] const ClientCounters& counters() const { return exchange_.counters(); }

 private:
  struct Waiter;
  class Place;

  LinkHandlers handlers();
  void receive(const Packet& packet);
  void flush();
  void end(const LinkEnd& end);
  void time_out(Exchange::Id id, std::uint64_t answers_before);
  void end_if_silent();
  void end_if_refused();

  boost::asio::any_io_executor executor_;
  std::chrono::milliseconds timeout_;
  SignsOfLife signs_;
  /// Runs while timeouts are examined; the responses when the newest of their requests was made.
  boost::asio::steady_timer silence_check_;
  bool examined_ = false;
  std::uint64_t answers_before_ = 0;
  std::size_t max_frame_;
  Exchange exchange_;
  std::unordered_map<Exchange::Id, Waiter*> waiters_;
  std::shared_ptr<Link> link_;
  std::function<void(const LinkEnd&)> ended_;
  std::function<void(const Packet&)> notified_;
};

}  // namespace millrace::cnc::ads
