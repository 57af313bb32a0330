// How a server reacts to the frames of one connection. Pure: the socket is outside.
//
//   Session session(device, options);
//   auto reaction = session.react(frame, now);
//   if (!reaction) …                       // close the connection; reaction.error() is the reason
//   send(*reaction);                       // nothing, or whole frames
//   send(session.poll(now));               // notifications, again at session.next_due()
#pragma once

#include <vector>

#include "cnc/ads/lingering.hpp"
#include "cnc/ads/subscriptions.hpp"
#include "cnc/ads/sum_commands.hpp"

namespace millrace::cnc::ads {

/// Reaction to a frame whose target NetId is not the server's. A TwinCAT router without a route to
/// the target answers with AMS error 7.
enum class ForeignTarget { answer_error_7, drop, close };

struct SessionOptions {
  /// The NetId that the server serves.
  NetId net_id{{127, 0, 0, 1, 1, 1}};
  ForeignTarget foreign_target = ForeignTarget::answer_error_7;
  /// The NetIds of the clients that have a route; a frame of any other closes its connection, as a
  /// TwinCAT does (inferred from many reports). Empty: every client has one. Clients with the
  /// server's own NetId need none.
  std::vector<NetId> routes{};
  SubscriptionLimits subscriptions{};
};

/// One per connection. Executes each frame exactly once, in the order of arrival.
class Session {
 public:
  /// With `lingering`, which must outlive the session, notifications survive a lost connection.
  Session(Device& device, SessionOptions options, Lingering* lingering = nullptr)
      : device_(device),
        options_(std::move(options)),
        subscriptions_(device, options_.subscriptions),
        lingering_(lingering),
        sums_(dynamic_cast<SumCommands*>(&device)) {}

  /// The frames to send in reaction to a received frame. An error means that the connection must be
  /// closed.
  tl::expected<Bytes, ProtocolError> react(const Frame& frame, Moment now);
  /// The notifications that are due.
  Bytes poll(Moment now) { return subscriptions_.poll(now); }
  /// When poll() is needed next.
  [[nodiscard]] std::optional<Subscriptions::Time> next_due() const {
    return subscriptions_.next_due();
  }
  /// A sum of many items is in progress: go_on() executes some of them, and returns the response
  /// after the last. Until then no other frame of the connection may be handled.
  [[nodiscard]] bool working() const { return work_.has_value(); }
  Bytes go_on();
  /// The connection is lost.
  void end();
  /// The client has released its port: the connection is to be closed once all output is sent, as
  /// its router does (inferred from clients, which wait for that).
  [[nodiscard]] bool over() const { return over_; }

 private:
  tl::expected<Bytes, ProtocolError> react_to_ads(BytesView body, Moment now);
  [[nodiscard]] tl::expected<Bytes, ProtocolError> react_to_foreign_target(
      const Header& header) const;
  Bytes react_to_router(const Frame& frame);
  /// Identifies the client: continues the notifications of its earlier connection.
  void recognise(const NetId& client, Moment now);
  Bytes answer(const Packet& request, Moment now);
  [[nodiscard]] bool has_route_to(const NetId& client) const;

  Device& device_;
  SessionOptions options_;
  Subscriptions subscriptions_;
  Lingering* lingering_;
  struct Work {
    Header request;
    SumWork sum;
  };
  /// Begins the request in slices if it is a sum of many items; returns a payload if it is refused
  /// as a whole.
  std::optional<Bytes> begin_work(const Packet& request);

  /// The device, if it can execute sums in slices.
  SumCommands* sums_;
  std::optional<Work> work_;
  /// The source of the first frame.
  std::optional<NetId> client_;
  // Where AMS routers begin to number the ports that they assign.
  std::uint16_t next_port_ = 32768;
  bool over_ = false;
};

}  // namespace millrace::cnc::ads
