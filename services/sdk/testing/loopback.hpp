// Tests a service with calls that are repeated, withdrawn or lost: a gateway and instances in one
// process, without a fabric, in milliseconds.
//
//   testing::Loopback loopback;
//   loopback.start({.uuid = "b0ad2ab8-…"}, print_label);
//   loopback.start({.uuid = "b0ad2ab8-…"}, print_label);
//   auto pending = loopback.send({.uuid = "b0ad2ab8-…", .text = "WELLE7"});
//   loopback.kill(*pending.instance());
//   EXPECT_EQ(pending.wait()->text, "printed");
//   EXPECT_EQ(pending.attempt(), 2U);
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "fabric/messages.hpp"
#include "services/sdk/service.hpp"
#include "services/sdk/testing/fake_call.hpp"

namespace millrace::services::sdk::testing {

/// A call in a Loopback; copies are the same call. Functions may be called from any thread.
class Pending {
 public:
  /// The final reply. Nullopt after `limit`, and once no reply will come: blocked or withdrawn.
  [[nodiscard]] std::optional<fabric::Reply> wait(std::chrono::milliseconds limit = patience) const;
  /// 0 before the first dispatch, then 1, 2, …
  [[nodiscard]] std::uint32_t attempt() const;
  /// The number of the instance that got the last attempt.
  [[nodiscard]] std::optional<std::size_t> instance() const;
  /// Its instance was killed, and it may run at most once: an operator must decide.
  [[nodiscard]] bool blocked() const;
  [[nodiscard]] std::vector<Response> interims() const;
  /// Number of final replies, repeated ones included.
  [[nodiscard]] std::size_t replies() const;

  /// The NC program withdraws its request: the handler is notified, and its response is dropped.
  void withdraw();
  /// The gateway requests the same attempt again, as after a restart.
  void repeat();

 private:
  friend class Loopback;
  struct State;
  explicit Pending(std::shared_ptr<State> state) : state_(std::move(state)) {}

  std::shared_ptr<State> state_;
};

/// Each call goes to a live instance with room for its UUID and channel, the least busy first. One
/// that has declined it is skipped for 10 ms, where a gateway skips it for a second. Functions may
/// be called from any thread, but not by the callback of a stop token.
class Loopback {
 public:
  Loopback();
  /// Cancels all calls that run, and waits for their handlers.
  ~Loopback();
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;

  /// Starts an instance with its own threads; returns its number: 0, 1, … Throws as Service does.
  /// Of `options` count uuid, channels, delivery, completion_signal, concurrency and error_state.
  std::size_t start(const ServiceOptions& options, Handler handler);
  std::size_t start(const ServiceOptions& options, const AsyncHandler& handler);
  /// The instance dies. Its handlers continue in this process, but their responses are lost: its
  /// calls are dispatched again with a higher attempt, or blocked if they may run at most once.
  void kill(std::size_t instance);

  /// A call of an NC program. Of `request` count key, uuid, text, state (0 stands for 1), deadline
  /// and replayed. Without a key it is made by a channel of its own. A channel has one call at a
  /// time: a new one withdraws the old one. Throws std::invalid_argument for a text of more than
  /// 127 bytes.
  Pending send(fabric::Request request);

 private:
  friend class Pending;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk::testing
