// Output queue of a stream: frames are pushed from anywhere on its executor and written by one
// coroutine.
//
//   Outbox outbox(transport, 1 << 20);
//   co_spawn(executor, outbox.run(), …);
//   outbox.push(frame);
//   co_await outbox.room();      // back-pressure: until the peer has read enough
#pragma once

#include <chrono>
#include <cstddef>
#include <limits>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>

#include "cnc/ads/stream.hpp"

namespace millrace::cnc::ads {

/// The most bytes of one read from a stream.
inline constexpr std::size_t chunk_size = 16384;

/// Not thread-safe; must outlive run().
class Outbox {
 public:
  /// `capacity`, in bytes, is the limit for room(); push() is never refused.
  Outbox(Transport& transport, std::size_t capacity);

  /// Takes whole frames, as encode_packet() returns them. Frames that are pushed together are sent
  /// in as few segments as possible.
  void push(BytesView frames);
  /// Limits each further write to this many bytes.
  void set_segment(std::size_t size) { segment_ = size; }
  /// Bytes pushed and not yet accepted by the stream.
  [[nodiscard]] std::size_t size() const { return waiting_.size() + writing_.size(); }
  /// When the stream last accepted bytes; the clock's epoch if it never has.
  [[nodiscard]] std::chrono::steady_clock::time_point last_taken() const { return last_taken_; }
  /// Writes pushed frames until the stream fails or stop() is called. Returns the error of the
  /// stream.
  boost::asio::awaitable<boost::system::error_code> run();
  /// Returns when size() is within the capacity or the outbox has stopped.
  boost::asio::awaitable<void> room();
  /// Returns when the stream has accepted all pushed bytes or the outbox has stopped.
  boost::asio::awaitable<void> drained();
  void stop();
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  boost::asio::awaitable<boost::system::error_code> write();

  Transport& transport_;
  std::size_t capacity_;
  boost::asio::steady_timer pushed_;
  boost::asio::steady_timer written_;
  Bytes waiting_;
  Bytes writing_;
  std::size_t segment_ = std::numeric_limits<std::size_t>::max();
  std::chrono::steady_clock::time_point last_taken_{};
  bool stopped_ = false;
};

}  // namespace millrace::cnc::ads
