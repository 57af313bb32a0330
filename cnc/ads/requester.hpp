// The requests of a client over its links, one link after the other: a coroutine asks, waits, and
// gets the answer, the timeout or the end of the link, whichever comes first.
//
//   requester->open(std::move(transport));
//   auto payload = co_await Requester::request(requester, 552, Command::read_state, Bytes());
//
// Whom an answer belongs to is decided by Exchange; the bytes are moved by Link.
#pragma once

#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "cnc/ads/client.hpp"
#include "cnc/ads/link.hpp"

namespace millrace::cnc::ads {

/// Not thread-safe. Kept alive by the requests under way.
class Requester : public std::enable_shared_from_this<Requester> {
 public:
  Requester(boost::asio::any_io_executor executor, const ClientOptions& options);

  /// Begins a link over what is connected; there must be none.
  void open(Transport transport);
  /// Ends the link: what is pending ends with link_lost, now and not when its time is up.
  void close();
  /// A request that goes out before close(), if the socket takes it at once. Its answer is not
  /// awaited.
  struct Farewell {
    std::uint16_t port = 0;
    Command command{};
    Bytes payload;
  };
  /// close(), after these.
  void leave(const std::vector<Farewell>& farewells);
  [[nodiscard]] const boost::asio::any_io_executor& executor() const { return executor_; }
  [[nodiscard]] bool is_open() const { return link_ != nullptr; }
  /// Our address towards the controller.
  [[nodiscard]] const std::string& local_address() const { return link_->local_address(); }
  /// Called when a link has ended, but not by close(), after the pending requests have.
  void on_end(std::function<void(const LinkEnd&)> handler) { ended_ = std::move(handler); }

  /// Called with each device notification.
  void on_notification(std::function<void(const Packet&)> handler) {
    notified_ = std::move(handler);
  }

  /// The payload of the response, or the error of its AMS header or of our own.
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
  void time_out(Exchange::Id id);

  boost::asio::any_io_executor executor_;
  std::chrono::milliseconds timeout_;
  std::size_t silent_timeouts_;
  std::size_t max_frame_;
  Exchange exchange_;
  std::unordered_map<Exchange::Id, Waiter*> waiters_;
  std::shared_ptr<Link> link_;
  std::function<void(const LinkEnd&)> ended_;
  std::function<void(const Packet&)> notified_;
};

}  // namespace millrace::cnc::ads
