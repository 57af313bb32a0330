// One call of a tool, from its order to its end.
//
//   OneCall call(participant, slot, order);
//   const Ended ended = call.run();
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/object.hpp>

#include "tools/bus/snapshot.hpp"
#include "tools/caller/caller.hpp"

namespace millrace::tools::caller {

/// Owns its loop; several threads may each run one with the same participant.
class OneCall : public CallerListener {
 public:
  /// All must outlive it. Throws std::runtime_error with Cyclone's reason.
  OneCall(fabric::dds::Participant& participant, const Slot& slot, const Order& order);

  /// Returns with the final reply, or why there is none; early if no instance serves the UUID after
  /// the time in which instances are discovered.
  Ended run();

  void on_ended(const Ended& ended) override;

 protected:
  [[nodiscard]] boost::asio::io_context& loop() { return io_; }
  /// On the loop.
  void give_up(const fabric::Message& reason) { caller_.give_up(call_, reason); }

 private:
  void wait_for_a_service();

  const Order& order_;
  fabric::CallId call_;
  Ended ended_;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer grace_;
  bus::ListeningTime time_;
  const fabric::dds::Participant& participant_;
  Caller caller_;
};

/// The end of a call for programs.
boost::json::object json_of(const Order& order, const Ended& ended);

}  // namespace millrace::tools::caller
