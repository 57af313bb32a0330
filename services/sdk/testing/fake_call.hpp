// Tests a handler with one call: without a fabric, in this thread.
//
//   EXPECT_EQ(testing::FakeCall({.text = "hello"}).run(length)->text, "5");
//
//   testing::FakeCall call({.text = "hello", .attempt = 2});
//   call.cancel();
//   length(call);            // a long handler returns early
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "fabric/messages.hpp"
#include "services/sdk/call.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk::testing {

/// Time for a handler that answers later.
inline constexpr std::chrono::seconds patience{10};

/// Decides as an instance does: a response that cannot be sent becomes an error response. Functions
/// may be called from any thread.
class FakeCall {
 public:
  /// Of `request` count key, call, attempt, uuid, text, state (0 stands for 1), deadline and
  /// replayed; of `options` completion_signal, delivery and error_state. Throws
  /// std::invalid_argument for a text of more than 127 bytes.
  explicit FakeCall(fabric::Request request = {}, const ServiceOptions& options = {});
  ~FakeCall();
  FakeCall(const FakeCall&) = delete;
  FakeCall& operator=(const FakeCall&) = delete;

  /// The argument of a Handler. Not after run().
  operator const Call&() const;  // NOLINT(google-explicit-constructor)

  /// The NC program withdraws its request.
  void cancel();

  /// Runs the handler as a service does, once; returns its last reply, final or declined. Nullopt
  /// if the call was cancelled: nothing is sent then. Throws std::runtime_error if the handler has
  /// not answered `limit` after it returned.
  std::optional<fabric::Reply> run(const Handler& handler,
                                   std::chrono::milliseconds limit = patience);
  std::optional<fabric::Reply> run(const AsyncHandler& handler,
                                   std::chrono::milliseconds limit = patience);

  /// Interim responses so far.
  [[nodiscard]] std::vector<Response> interims() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk::testing
