// One connection of a server: reads, reacts and writes, until either side closes it.
#pragma once

#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>

#include "cnc/ads/outbox.hpp"
#include "cnc/ads/server.hpp"

namespace millrace::cnc::ads {

/// Not thread-safe. Keeps itself alive while its coroutines run.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  /// Device and options must outlive the connection; `lingering` must outlive its run(). The faults
  /// among the options may change.
  Connection(Transport transport, Device& device, const ServerOptions& options,
             const SessionOptions& session, Lingering* lingering, base::program::Log log);

  /// Serves until the connection ends.
  boost::asio::awaitable<void> run();
  /// Returns when all responses and notifications produced so far are sent, or the connection has
  /// ended.
  static boost::asio::awaitable<void> drained(std::shared_ptr<Connection> self);
  /// Ends the connection; it does not call the device afterwards.
  void close();
  [[nodiscard]] bool closed() const { return outbox_.stopped(); }
  /// No client has sent a whole frame yet.
  [[nodiscard]] bool half_open() const { return !closed() && !session_.has_client(); }
  [[nodiscard]] const boost::asio::ip::address& address() const { return address_; }
  /// For example "127.0.0.1:54321".
  [[nodiscard]] const std::string& peer() const { return peer_; }

 private:
  static boost::asio::awaitable<void> write(std::shared_ptr<Connection> self);
  static boost::asio::awaitable<void> send_when_due(std::shared_ptr<Connection> self);
  static boost::asio::awaitable<void> close_when_idle(std::shared_ptr<Connection> self);
  boost::asio::awaitable<void> receive();
  boost::asio::awaitable<void> react_to_frames();
  void send(Bytes frames, Moment now);
  /// Waits until the peer has read enough of its responses.
  boost::asio::awaitable<void> room();
  /// Deliberately delayed responses fill all the memory that they may use.
  [[nodiscard]] bool line_is_full() const;
  [[nodiscard]] Subscriptions::Time next_due() const;
  /// When the last byte was sent or received.
  [[nodiscard]] Subscriptions::Time last_moved() const;
  /// The peer has received all that was sent, and more is due.
  [[nodiscard]] bool peer_waits() const;

  Transport transport_;
  boost::asio::any_io_executor executor_;
  const ServerOptions& options_;
  Session session_;
  FrameReader reader_;
  Outbox outbox_;
  FaultyLine faulty_line_;
  // Expires when the next notification or delayed response is due.
  boost::asio::steady_timer due_;
  boost::asio::steady_timer idle_;
  Subscriptions::Time last_received_;
  base::program::Log log_;
  boost::asio::ip::address address_;
  std::string peer_;
};

}  // namespace millrace::cnc::ads
