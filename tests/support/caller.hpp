// A gateway's place for tests of services: finds their instances and calls them.
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
  /// True once there is none.
  bool await_no_instance(const std::string& uuid, std::chrono::milliseconds timeout = patience);

  /// What discovery tells of a ready instance; throws std::runtime_error if there is none.
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
  /// The final reply if it is there by now.
  bool poll_reply(const fabric::Request& request, fabric::Reply& reply);

  /// Does what is due, for who waits for something else: what is published is sent, at the latest
  /// then.
  void attend();

  /// A reply to this call that comes from now on is a new one.
  void forget_reply(const fabric::Request& request);

  /// All of it: request, publish, await, withdraw.
  fabric::Reply call(const std::string& uuid, const std::string& text, std::uint16_t channel = 1);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
