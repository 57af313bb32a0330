// The requests of one client: which are on the wire, which wait, and whom an answer belongs to.
// Pure: the socket and the clock are outside.
//
//   const auto id = exchange.begin(552, Command::read, payload);
//   send(exchange.take_output());
//   …
//   if (auto done = exchange.receive(packet)) wake(done->id, done->response);
//   send(exchange.take_output());          // what waited for room, answers to the controller
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

/// What happened on a client since it exists.
struct ClientCounters {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;
  /// Responses nobody waited for any more.
  std::uint64_t late = 0;
  /// Frames addressed to someone else, mirrored frames, router notes, what nobody asked to be told.
  std::uint64_t foreign = 0;
  /// Frames of device notifications, however many samples are in them.
  std::uint64_t notifications = 0;
  /// Requests that were answered, also with an error, and how long that took all in all.
  std::uint64_t answered = 0;
  std::chrono::nanoseconds waited{};
};

class Exchange {
 public:
  /// The invoke id of a request.
  using Id = std::uint32_t;

  /// What came of a request: the payload of its response, or the error of its AMS header.
  struct Completion {
    Id id = 0;
    Result<Bytes> response;
  };

  /// At most `window` requests are on the wire at once. Ids count up from `first_id`, which should
  /// differ from run to run: a router may deliver what an earlier client at our address asked for.
  Exchange(Address source, NetId target, std::size_t window, Id first_id);

  /// A request to an AMS port of the target. It goes out with take_output(), now or once there is
  /// room in the window.
  Id begin(std::uint16_t port, Command command, BytesView payload);
  /// A request that goes out at once and whose answer nobody waits for.
  void send(std::uint16_t port, Command command, BytesView payload);
  /// The answer did not come in time; one that comes later is dropped.
  void time_out(Id id);
  /// The answer came after this time: for the counters.
  void answered_after(std::chrono::nanoseconds time);
  /// Nobody waits for the answer any more.
  void give_up(Id id);
  /// A packet from the connection: an answer, or what a controller asks on its own account. The
  /// latter is answered like a router would do it.
  std::optional<Completion> receive(const Packet& packet);
  /// The packet is a device notification of our target for us. Anything else, a notification from
  /// elsewhere among it, is for receive().
  bool notifies(const Packet& packet);
  /// A frame of the router, which means nothing to us.
  void receive_router_frame() { ++counters_.foreign; }
  /// The connection is gone: the requests that were pending.
  std::vector<Id> lose_link();

  /// Whole frames to send, in this order.
  [[nodiscard]] Bytes take_output();
  /// Requests timed out since the peer was last heard.
  [[nodiscard]] std::size_t silent_timeouts() const { return silent_timeouts_; }
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

  void fill_window();
  void finish(Id id);
  void adapt_window(ErrorCode outcome);
  void answer(const Packet& request);

  Address source_;
  NetId target_;
  std::size_t max_window_;
  std::size_t window_;
  Id next_id_;
  std::size_t answers_since_change_ = 0;
  std::size_t silent_timeouts_ = 0;
  std::unordered_map<Id, OnWire> on_wire_;
  std::deque<Waiting> waiting_;
  ByteWriter output_;
  ClientCounters counters_;
};

}  // namespace millrace::cnc::ads
