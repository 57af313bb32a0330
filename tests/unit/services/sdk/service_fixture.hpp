// A service on its own fabric, and the gateway that calls it, for tests of services.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "services/sdk/service.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"

namespace millrace::services::sdk {

inline const std::string uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47";

/// Blocks handlers until the test opens it.
class Latch {
 public:
  void open() {
    const std::lock_guard guard(lock_);
    open_ = true;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock guard(lock_);
    changed_.wait(guard, [this] { return open_; });
  }

 private:
  std::mutex lock_;
  std::condition_variable changed_;
  bool open_ = false;
};

class ServiceTest : public testing::Test {
 protected:
  [[nodiscard]] ServiceOptions options(std::uint32_t concurrency = 1) const {
    return {.uuid = uuid, .name = "test", .concurrency = concurrency, .domain = domain.number()};
  }

  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }
  bool until_ready(const Service& sut) {
    return until([&] { return gateway.ready.contains(sut.identity().id); });
  }

  fabric::Request request(const Service& sut, std::uint64_t number, std::uint16_t channel = 1) {
    return {.key = {.machine = "cnc", .channel = channel},
            .call = {.epoch = 1, .number = number},
            .assigned = sut.identity().id,
            .uuid = uuid,
            .text = "4",
            .state = 1};
  }

  void call(const fabric::Request& request) { ASSERT_TRUE(end.publish(request)); }

  /// The next reply.
  fabric::Reply next_reply() {
    EXPECT_TRUE(until([&] { return gateway.replies.size() > replies_read_; }));
    return replies_read_ < gateway.replies.size() ? gateway.replies[replies_read_++]
                                                  : fabric::Reply{};
  }

  tests::Domain domain;
  boost::asio::io_context context;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  fabric::RecordingGateway gateway;
  fabric::endpoints::CallEndpoint end{participant, context.get_executor(), gateway};

 private:
  std::size_t replies_read_ = 0;
};

inline Response echo(const Call& call) {
  return {.text = call.text(), .state = call.state()};
}

}  // namespace millrace::services::sdk
