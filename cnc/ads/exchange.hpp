// The requests of one client: which are on the wire, which wait, and to which request a response
// belongs. Pure: the socket and the clock are outside.
//
//   const auto id = exchange.begin(552, Command::read, payload);
//   send(exchange.take_output());
//   …
//   if (auto done = exchange.receive(packet)) wake(done->id, done->response);
//   send(exchange.take_output());          // requests that waited, responses to the controller
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

/// Counters of a client since its construction.
struct ClientCounters {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;
  /// Responses whose request is no longer pending.
  std::uint64_t late = 0;
  /// Frames for other addresses, mirrored frames, router frames, unexpected notifications.
  std::uint64_t foreign = 0;
  /// Frames of device notifications, independent of the number of their samples.
  std::uint64_t notifications = 0;
  /// Requests that got a response, including errors, and the sum of their response times.
  std::uint64_t answered = 0;
  std::chrono::nanoseconds waited{};
};

class Exchange {
 public:
  /// The invoke id of a request.
  using Id = std::uint32_t;

  /// The result of a request: the payload of its response, or the error of its AMS header.
  struct Completion {
    Id id = 0;
    std::uint16_t port = 0;
    Result<Bytes> response;
  };

  /// At most `window` requests are on the wire at once. Ids count up from `first_id`, which should
  /// differ from run to run: a router may deliver a response for an earlier client with our
  /// address.
  Exchange(Address source, NetId target, std::size_t window, Id first_id);

  /// Queues a request to an AMS port of the target. take_output() returns it, at once or when the
  /// window has room.
  Id begin(std::uint16_t port, Command command, BytesView payload);
  /// Sends a request at once and ignores its response.
  void send(std::uint16_t port, Command command, BytesView payload);
  /// The request timed out; a later response is dropped, but counts for answers().
  void time_out(Id id);
  /// Adds the response time of a request to the counters.
  void answered_after(std::chrono::nanoseconds time);
  /// Abandons the request; a later response is dropped.
  void give_up(Id id);
  /// Handles a packet from the connection: a response, or a request of the controller. The latter
  /// gets the response of a router.
  std::optional<Completion> receive(const Packet& packet);
  /// The packet is a device notification of our target for us. Pass any other packet, including a
  /// notification from elsewhere, to receive().
  bool notifies(const Packet& packet);
  /// Counts a frame of the router, which has no meaning for us.
  void receive_router_frame() { ++counters_.foreign; }
  /// The connection is lost. Returns the requests that were pending.
  std::vector<Id> lose_link();

  /// Whole frames, in the order in which to send them.
  [[nodiscard]] Bytes take_output();
  /// Responses to requests of this connection, in time or after their timeout. Nothing else proves
  /// that the controller lives: its router, or a proxy, sends requests, notifications, mirrored
  /// frames, responses for earlier clients, and errors for requests that it could not deliver, also
  /// while the controller answers nothing.
  [[nodiscard]] std::uint64_t answers() const { return answers_; }
  [[nodiscard]] const ClientCounters& counters() const { return counters_; }

 private:
  struct OnWire {
    Command command{};
    std::uint16_t port = 0;
  };
  struct Waiting {
    Id id = 0;
    OnWire request;
    Bytes frame;
  };

  static constexpr std::size_t most_timed_out = 256;

  void fill_window();
  void finish(Id id);
  [[nodiscard]] bool answers_late(const Header& header);
  void adapt_window(ErrorCode outcome);
  void answer(const Packet& request);

  Address source_;
  NetId target_;
  std::size_t max_window_;
  std::size_t window_;
  Id next_id_;
  std::size_t answers_since_change_ = 0;
  std::uint64_t answers_ = 0;
  std::unordered_map<Id, OnWire> on_wire_;
  /// The last requests that timed out on the wire.
  std::deque<std::pair<Id, OnWire>> timed_out_;
  std::deque<Waiting> waiting_;
  ByteWriter output_;
  ClientCounters counters_;
};

}  // namespace millrace::cnc::ads
