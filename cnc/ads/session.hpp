// How a server reacts to the frames of one connection. Pure: the socket is outside.
//
//   Session session(device, options);
//   auto reaction = session.react(frame, now);
//   if (!reaction) …                       // close the connection; reaction.error() is the reason
//   send(*reaction);                       // nothing, or whole frames
//   send(session.poll(now));               // notifications, again at session.next_due()
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"
#include "cnc/ads/subscriptions.hpp"
#include "cnc/ads/sum_commands.hpp"

namespace millrace::cnc::ads {

// Notifications of lost connections, which continue when a client of the same NetId connects again.
// A TwinCAT router does so, by reports of clients (inferred).
//
//   lingering.keep(client, subscriptions.give_up());       // the connection is lost
//   if (auto kept = lingering.take(client))                // its first frame on a new connection
//     subscriptions.adopt(std::move(*kept), now);

class Lingering {
 public:
  /// Replaces earlier subscriptions of the client. While those of 100 clients are kept, those of a
  /// further client are dropped (our choice).
  void keep(const NetId& client, Subscriptions::Kept kept) {
    if (!kept.subscriptions.empty() && (kept_.size() < most_clients || kept_.contains(client))) {
      kept_.insert_or_assign(client, std::move(kept));
    }
  }
  std::optional<Subscriptions::Kept> take(const NetId& client) {
    auto node = kept_.extract(client);
    return node.empty() ? std::nullopt : std::optional(std::move(node.mapped()));
  }

 private:
  static constexpr std::size_t most_clients = 100;
  std::map<NetId, Subscriptions::Kept> kept_;
};

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
  /// A client with a route has sent a whole frame.
  [[nodiscard]] bool has_client() const { return client_.has_value(); }
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

// The response of a Device to one ADS request. Notification requests are handled elsewhere
// (subscriptions.hpp).

/// Returns the payload of the response. A payload that does not fit its command gets invalid_size;
/// an unsupported command gets service_not_supported. Both errors have the form of that command's
/// response, so that no client waits for more bytes.
Bytes answer(Device& device, std::uint16_t port, Command command, BytesView payload);

}  // namespace millrace::cnc::ads
