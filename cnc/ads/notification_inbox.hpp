// Who is told of which device notification: pure, the requests and the socket are outside.
//
//   NotificationInbox inbox;
//   inbox.expect();                                   // a request that adds some is on its way
//   …                                                 // samples may come before its answer is read
//   auto held = inbox.add(552, handles, told);        // the answer: what came meanwhile
//   inbox.receive(552, stamps);                       // → told(item, value)
//   for (auto stranger : inbox.take_strangers()) …    // to be deleted at the controller, once
//
// A handle belongs to an AMS port of the target. The first sample follows the answer to the request
// that adds it so closely that it is often here before whoever asked goes on; and controllers are
// reported to go on with notifications of a connection that is lost, under handles nobody knows.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {

/// Is told a new value of the item of a subscription with this number. No value means that the
/// handle is no longer valid (documented, IB/tc3_ads_intro): nothing more comes of it.
using Told = std::function<void(std::size_t item, BytesView value)>;

class NotificationInbox {
 public:
  /// Until the next add() samples of unknown handles are held, not strangers.
  void expect() { ++expected_; }
  /// The request is answered: handle i is that of item i, 0 of one that was refused. Hands out what
  /// came before.
  void add(std::uint16_t port, const std::vector<std::uint32_t>& handles, const Told& told);
  /// They are told nothing any more. What still comes is no stranger.
  void remove(std::uint16_t port, const std::vector<std::uint32_t>& handles);
  void receive(std::uint16_t port, const std::vector<Stamp>& stamps);

  struct Handle {
    std::uint16_t port = 0;
    std::uint32_t number = 0;
    auto operator<=>(const Handle&) const = default;
  };
  /// Handles that came unasked since the last call; each is named once.
  std::vector<Handle> take_strangers() { return std::exchange(strangers_, {}); }
  /// The link is gone, and all handles with it.
  void clear();

 private:
  struct Receiver {
    std::shared_ptr<const Told> told;
    std::size_t item = 0;
  };
  struct Held {
    Handle handle;
    Bytes value;
  };
  /// Of held samples, and of handles that are remembered as no ours: a controller that floods us
  /// fills no memory. What is held beyond it is lost, as ADS may lose it anyway.
  static constexpr std::size_t most = 4096;

  /// Whoever is told may end the client, and this with it.
  static void tell(const Receiver& receiver, BytesView value) {
    const Receiver kept = receiver;
    (*kept.told)(kept.item, value);
  }
  void strange(const Handle& handle);

  std::map<Handle, Receiver> receivers_;
  std::vector<Held> held_;
  std::size_t expected_ = 0;
  /// Strangers that were named, and handles that were ours.
  std::set<Handle> known_strangers_;
  std::vector<Handle> strangers_;
};

}  // namespace millrace::cnc::ads
