// A client connected to a FakeCnc over loopback.
#pragma once

#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "cnc/ads/client.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/variables/fake_cnc.hpp"

namespace millrace::cnc::variables {

class ControllerFixture : public testing::Test {
 protected:
  /// With sum commands or without.
  void start(bool sums = true) {
    ads::ServerOptions options;
    options.tcp_port = 0;
    ads::Device& device = sums ? static_cast<ads::Device&>(with_sums) : cnc;
    server.emplace(io.get_executor(), device, options, base::program::no_log());
    ads::ClientOptions client_options;
    client_options.tcp_port = server->tcp_port();
    client_options.target = options.session.net_id;
    client.emplace(io.get_executor(), client_options);
    ASSERT_TRUE(wait_for(client->connect()));
  }
  template <typename T>
  T wait_for(boost::asio::awaitable<T> work) {
    return tests::wait_for(io, std::move(work));
  }

  boost::asio::io_context io;
  FakeCnc cnc;
  ads::SumCommands with_sums{cnc};
  std::optional<ads::Server> server;
  std::optional<ads::Client> client;
};

}  // namespace millrace::cnc::variables
