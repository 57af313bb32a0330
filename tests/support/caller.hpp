// A gateway's part for tests of services: finds their instances and calls them.
//
//   Caller caller(domain.number());
//   ASSERT_TRUE(caller.await_instance(uuid));
//   EXPECT_EQ(caller.call(uuid, "4").text, "2");
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "fabric/messages.hpp"
#include "tests/support/process.hpp"

namespace millrace::tests {

class Caller {
 public:
  explicit Caller(std::uint32_t domain);
  ~Caller();

  /// True once an instance of `uuid` is ready that is not draining.
  bool await_instance(const std::string& uuid, std::chrono::milliseconds timeout = patience);
  /// True once there is no such instance.
  bool await_no_instance(const std::string& uuid, std::chrono::milliseconds timeout = patience);

  /// The announced identity of a ready instance; throws std::runtime_error if there is none.
  [[nodiscard]] fabric::InstanceIdentity identity(const std::string& uuid) const;

  /// The next request of a channel to any ready instance, with a new call id.
  fabric::Request request(const std::string& uuid, const std::string& text,
                          std::uint16_t channel = 1);
  void publish(const fabric::Request& request);
  void publish(const fabric::Event& event);
  void publish(const fabric::ChannelStatus& status);
  void withdraw(const fabric::Request& request);
  /// The final reply to a call; throws std::runtime_error if none comes.
  fabric::Reply await_reply(const fabric::Request& request,
                            std::chrono::milliseconds timeout = patience);
  /// The final reply, if it has arrived.
  bool poll_reply(const fabric::Request& request, fabric::Reply& reply);

  /// Does what is due, in particular sends published samples, while the caller waits for something
  /// else.
  void attend();

  /// A reply to this call that arrives from now on is a new one.
  void forget_reply(const fabric::Request& request);

  /// A whole call: request, publish, await, withdraw.
  fabric::Reply call(const std::string& uuid, const std::string& text, std::uint16_t channel = 1);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
