// Calls services without a controller: the requesting endpoint of a fabric for tools.
//
//   const Slot slot("call", participant.options());
//   Caller caller(participant, io.get_executor(), listener, slot);
//   const auto call = caller.call({.key = {slot.machine(), 1}, .uuid = uuid, .text = "3"});
//   …  listener.on_ended({.call = *call, .reply = …})
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "fabric/plant/plant.hpp"
#include "tools/caller/order.hpp"
#include "tools/caller/slot.hpp"

namespace millrace::tools::caller {

/// Called on the executor, one at a time; its functions may use the caller, but not end it.
class CallerListener {
 public:
  virtual ~CallerListener() = default;
  virtual void on_ended(const Ended& ended) = 0;
  virtual void on_interim(const fabric::Reply& reply) { static_cast<void>(reply); }
  /// An instance came, changed or left: why_unserved may have another result now.
  virtual void on_instances() {}
  /// An endpoint looks like an instance's but cannot be one.
  virtual void on_ignored(const std::string& reason) { static_cast<void>(reason); }
};

/// RAII; use and end it on the executor, which runs one thing at a time and outlives it. Its end
/// withdraws pending calls.
class Caller {
 public:
  /// All but the executor's handle outlive the caller. Throws std::runtime_error with Cyclone's
  /// reason.
  Caller(fabric::dds::Participant& participant, const boost::asio::any_io_executor& executor,
         CallerListener& listener, const Slot& slot);
  ~Caller();
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  /// Dispatches the call as soon as an instance is free for it: one whose scope names the channel
  /// before one that takes any, then the least busy, then round robin; to another one if the first
  /// is lost. Ends with on_ended, never from within this function. Errors: Calls::add.
  tl::expected<fabric::CallId, std::string> call(const Order& order);
  /// Withdraws a call; it ends with this reason.
  void give_up(const fabric::CallId& call, const fabric::Message& reason);

  /// Why no discovered instance serves this UUID for this channel; nullopt if one does.
  [[nodiscard]] std::optional<fabric::Message> why_unserved(const std::string& uuid,
                                                            const fabric::ChannelKey& key) const;
  /// Whether an instance has the call now.
  [[nodiscard]] bool is_given_out(const fabric::CallId& call) const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Why a call in this channel would disturb a real one: a gateway serves its machine. Nullopt if it
/// is free.
std::optional<std::string> reason_taken(const fabric::plant::Plant& live,
                                        const fabric::ChannelKey& key);

}  // namespace millrace::tools::caller
