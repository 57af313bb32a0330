// One connection of a client: receives and sends frames until either side ends it. It reports the
// reason of the end once; Exchange interprets the frames.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "cnc/ads/client.hpp"
#include "cnc/ads/frame.hpp"
#include "cnc/ads/outbox.hpp"

namespace millrace::cnc::ads {

/// How a connection ended.
struct LinkEnd {
  enum class Cause { closed_by_peer, broken_protocol, silent, undelivered, closed_by_us };
  Cause cause = Cause::closed_by_us;
  /// The error text of the system or of the codec.
  std::string detail{};
  /// The time since its last response, if it is silent or its router delivers nothing.
  std::chrono::nanoseconds silent_for{};
  /// Its responses come, but none within this time.
  std::optional<std::chrono::milliseconds> late{};
  /// The router's error, if it delivers nothing.
  ErrorCode error = ErrorCode::none;
};

struct LinkHandlers {
  std::function<void(const Packet&)> packet;
  std::function<void()> router_frame;
  /// Called once, as the last call; not after close().
  std::function<void(const LinkEnd&)> ended;
};

/// Not thread-safe. Keeps itself alive while its coroutines run.
///
/// What the controller has not received when the connection ends, or when the process is killed, is
/// dropped. Linux would else go on sending it, beside the next connection: when the network is
/// back, an old REQUEST_STATE = 0 would wipe the next request of the NC program, which would wait
/// for ever.
class Link : public std::enable_shared_from_this<Link> {
 public:
  /// What the controller has not received after `undelivered_for` ends the connection also while
  /// this process stands still.
  Link(Transport transport, std::size_t max_frame, std::chrono::milliseconds undelivered_for,
       LinkHandlers handlers);

  void start();
  void send(BytesView frames) { outbox_.push(frames); }
  /// Call it before close(): passes the frames to the stream at once, as far as it accepts them.
  /// Waits until the other side has read them and closes, a few milliseconds, at most 50. Sends
  /// nothing if other output is still pending.
  void send_last(BytesView frames);
  /// Ends the connection without a call of `ended`.
  void close() { end({LinkEnd::Cause::closed_by_us, {}}); }
  /// Our local address of the connection.
  [[nodiscard]] const std::string& local_address() const { return local_address_; }

 private:
  static boost::asio::awaitable<void> receive(std::shared_ptr<Link> self);
  static boost::asio::awaitable<void> write(std::shared_ptr<Link> self);
  tl::expected<void, ProtocolError> hand_out_frames();
  void end(const LinkEnd& end);

  Transport transport_;
  FrameReader reader_;
  Outbox outbox_;
  LinkHandlers handlers_;
  std::string local_address_;
};

// Explains to the operator why a client has no connection: what happened, and what to check.

/// For the end of an established connection. `again`: the peer has closed several in a row, and
/// accepted each next one at once.
LinkError explain_end(const ClientOptions& options, const LinkEnd& end, bool again);
/// For a TCP connection whose first request did not return a state: `answer` is its error, `end` is
/// how the connection ended if it did.
LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address);
/// For a failed TCP connection, with the reason that dial() returned.
LinkError explain_no_connection(const ClientOptions& options,
                                const base::messages::Message& reason);

}  // namespace millrace::cnc::ads
