// The requests of a client over its connections, one connection after the other. A coroutine sends
// a request and gets the response, the timeout or the end of the connection, whichever comes first.
//
//   requester->open(std::move(transport));            // of a class that handles notifications
//   auto payload = co_await Requester::request(requester, 552, Command::read_state, Bytes());
//
// Exchange assigns responses to requests; Link moves the bytes.
#pragma once

#include <chrono>
#include <cstdint>
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
  virtual ~Requester() = default;
  Requester(const Requester&) = delete;
  Requester& operator=(const Requester&) = delete;

  /// Begins a connection over this transport; none may be open.
  void open(Transport transport);
  /// Ends the connection: pending requests end with link_lost at once, not at their timeout.
  void disconnect();
  /// A request that is sent before the end, if the socket accepts it at once. Its response is
  /// ignored.
  struct LastRequest {
    std::uint16_t port = 0;
    Command command{};
    Bytes payload;
  };
  /// Sends these requests, then ends the connection.
  void disconnect(const std::vector<LastRequest>& farewells);
  [[nodiscard]] const boost::asio::any_io_executor& executor() const { return executor_; }
  [[nodiscard]] bool is_open() const { return link_ != nullptr; }
  /// Our local address of the connection.
  [[nodiscard]] const std::string& local_address() const { return link_->local_address(); }

  /// The payload of the response, the error of its AMS header, or one of our own errors.
  static boost::asio::awaitable<Result<Bytes>> request(std::shared_ptr<Requester> self,
                                                       std::uint16_t port, Command command,
                                                       Bytes payload);
  [[nodiscard]] const ClientCounters& counters() const { return exchange_.counters(); }

 private:
  /// After the pending requests have ended; not for disconnect().
  virtual void on_end(const LinkEnd& end) = 0;
  virtual void on_notification(const Packet& packet) = 0;

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
};

}  // namespace millrace::cnc::ads
