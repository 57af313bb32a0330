// Assigns device notifications to their receivers. Pure: the requests and the socket are outside.
//
//   NotificationInbox inbox;
//   inbox.expect();                                   // a request that adds some is on its way
//   …                                                 // samples may come before the response
//   inbox.add(552, handles, handler);                    // the response; passes on the samples so far
//   inbox.receive(552, stamps);                       // → handler(item, value)
//   for (auto stranger : inbox.take_strangers()) …    // delete them at the controller, once
//
// A handle belongs to an AMS port of the target. The first sample follows the response to its
// subscription so closely that it often arrives before the caller continues. Controllers are
// reported to continue the notifications of a lost connection, under handles that the new one does
// not know.
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

/// Handler of new values of the item with this number in its subscription. An empty value means
/// that the handle is no longer valid (documented, IB/tc3_ads_intro): no further sample follows.
using NotificationHandler = std::function<void(std::size_t item, BytesView value)>;

class NotificationInbox {
 public:
  /// Until the next add(), samples of unknown handles are held and are not strangers.
  void expect() { ++expected_; }
  /// The request has its response: handle i belongs to item i; 0 marks an item that was refused.
  /// Passes on the samples that were held.
  void add(std::uint16_t port, const std::vector<std::uint32_t>& handles,
           const NotificationHandler& handler);
  /// Ends the calls for these handles. Samples that still come for them are not strangers.
  void remove(std::uint16_t port, const std::vector<std::uint32_t>& handles);
  void receive(std::uint16_t port, const std::vector<Stamp>& stamps);

  struct Handle {
    std::uint16_t port = 0;
    std::uint32_t number = 0;
    auto operator<=>(const Handle&) const = default;
  };
  /// Unknown handles whose samples came since the last call; each handle is returned once.
  std::vector<Handle> take_strangers() { return std::exchange(strangers_, {}); }
  /// The connection is lost, and all handles with it.
  void clear();

 private:
  struct Receiver {
    std::shared_ptr<const NotificationHandler> handler;
    std::size_t item = 0;
  };
  struct Held {
    Handle handle;
    Bytes value;
  };
  /// Limit of held samples, and of known foreign handles: a flood of samples cannot exhaust the
  /// memory. Samples beyond it are lost, as ADS may lose them anyway.
  static constexpr std::size_t most = 4096;

  /// The handler may destroy the client, and this object with it.
  static void pass_on(const Receiver& receiver, BytesView value) {
    const Receiver kept = receiver;
    (*kept.handler)(kept.item, value);
  }
  void strange(const Handle& handle);

  std::map<Handle, Receiver> receivers_;
  std::vector<Held> held_;
  std::size_t expected_ = 0;
  /// Strangers that were returned, and handles that we have removed.
  std::set<Handle> known_strangers_;
  std::vector<Handle> strangers_;
};

}  // namespace millrace::cnc::ads
