// One connection of a client: frames in and out, until either side ends it. Why it ended is
// told once; what the frames mean is decided elsewhere (Exchange).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "cnc/ads/frame.hpp"
#include "cnc/ads/outbox.hpp"

namespace millrace::cnc::ads {

/// How a connection ended.
struct LinkEnd {
  enum class Cause { closed_by_peer, broken_protocol, silent, closed_by_us };
  Cause cause = Cause::closed_by_us;
  /// What the system or the codec says about it; what was not answered.
  std::string detail;
};

struct LinkHandlers {
  std::function<void(const Packet&)> packet;
  std::function<void()> router_frame;
  /// Once, as the last call; not after close().
  std::function<void(const LinkEnd&)> ended;
};

/// Not thread-safe. Keeps itself alive while its coroutines run.
class Link : public std::enable_shared_from_this<Link> {
 public:
  Link(Transport transport, std::size_t max_frame, LinkHandlers handlers);

  void start();
  void send(BytesView frames) { outbox_.push(frames); }
  /// Before close(): hands the frames to the stream now, as far as it takes them, and waits for the
  /// other side to have read them and to close, a few milliseconds, at most 50. Nothing is
  /// sent if something else is still on its way out.
  void say_farewell(BytesView frames);
  /// Ends it without a call of `ended`.
  void close() { end({LinkEnd::Cause::closed_by_us, {}}); }
  /// Our address towards the controller.
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

}  // namespace millrace::cnc::ads
