// The faults that a server can make on request, and how the client handles them.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "cnc/ads/client.hpp"
#include "cnc/ads/faults.hpp"
#include "cnc/ads/server.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"
#include "tests/unit/cnc/ads/raw_peer.hpp"

namespace millrace::cnc::ads {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

namespace asio = boost::asio;
using testing::HasSubstr;
using tests::run_until;
using tests::wait_for;

class ServerFaults : public testing::Test {
 protected:
  using Data = Result<Bytes>;

  ServerFaults() { device.values[{1, 1}] = {1, 2, 3, 4}; }

  void start(ServerOptions options = {}) {
    options.tcp_port = 0;
    sut.emplace(io.get_executor(), device, options, base::program::no_log());
    client_options.tcp_port = sut->tcp_port();
    client_options.target = options.session.net_id;
  }
  Client& connect() {
    client.emplace(io.get_executor(), client_options);
    const auto connected = wait_for(io, client->connect());
    EXPECT_TRUE(connected) << connected.error().message.text;
    return *client;
  }
  LinkError failure(Client& tried) {
    const auto connected = wait_for(io, tried.connect());
    return connected ? LinkError{ErrorCode::none, "connected"} : connected.error();
  }
  Data read() { return wait_for(io, client->read(552, {1, 1}, 4)); }

  asio::io_context io;
  MemoryDevice device;
  std::optional<Server> sut;
  ClientOptions client_options;
  std::optional<Client> client;
};

TEST_F(ServerFaults, AnswersInSingleBytes) {
  ServerOptions options;
  options.faults.segment = 1;
  start(options);
  connect();
  EXPECT_EQ(*read(), (Bytes{1, 2, 3, 4}));
}

TEST_F(ServerFaults, RefusesConnections) {
  ServerOptions options;
  options.faults.refuse_connections = true;
  start(options);
  Client refused(io.get_executor(), client_options);
  EXPECT_THAT(failure(refused).message, HasSubstr("closed the connection before the first answer"));
}

TEST_F(ServerFaults, DoesNotServeAClientWithoutARoute) {
  ServerOptions options;
  options.session.routes = {*NetId::parse("10.0.0.1.1.1")};
  start(options);
  Client stranger(io.get_executor(), client_options);
  EXPECT_THAT(failure(stranger).message, HasSubstr("route missing"));
  EXPECT_EQ(device.calls, 0);
  client_options.source.net_id = options.session.routes[0];
  connect();
  EXPECT_TRUE(read());
}

TEST_F(ServerFaults, ClosesTheOlderConnectionOfOneAddress) {
  ServerOptions options;
  options.one_connection_per_address = true;
  start(options);
  client_options.timeout = 10s;
  connect();
  std::vector<LinkError> downs;
  client->on_down([&](const LinkError& why) { downs.push_back(why); });
  Client newer(io.get_executor(), client_options);
  EXPECT_TRUE(wait_for(io, newer.connect()));
  ASSERT_TRUE(run_until(io, [&] { return !downs.empty(); }));
  EXPECT_TRUE(newer.up());
  // The two take the connection from one another in turns.
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_TRUE(wait_for(io, client->connect()));
    ASSERT_TRUE(run_until(io, [&] { return !newer.up(); }));
    EXPECT_TRUE(wait_for(io, newer.connect()));
    ASSERT_TRUE(run_until(io, [&] { return downs.size() == i + 1; }));
  }
  EXPECT_THAT(downs[4].message, HasSubstr("another ADS client on this host?"));
}

std::size_t open_files() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

// Under a sanitizer the allocator reports no numbers; there the leak checker does the work.
TEST_F(ServerFaults, AThousandConnectionsLeaveNothingBehind) {
  start();
  const auto connect_and_leave = [this](int count) {
    for (int i = 0; i < count; ++i) {
      connect();
      read();
      client.reset();
    }
    EXPECT_TRUE(run_until(io, [this] { return sut->connections() == 0; }));
  };
  connect_and_leave(50);  // until all reusable memory is allocated
  const auto files = open_files();
  const auto memory = mallinfo2().uordblks;
  connect_and_leave(1000);
  EXPECT_EQ(open_files(), files);
  EXPECT_LT(mallinfo2().uordblks, memory + 10'000) << "that would be 10 bytes for each connection";
}

constexpr FaultyLine::Time start(1h);

TEST(FaultyLine, DelaysEachAnswer) {
  FaultyLine sut;
  sut.push({1}, {.delay = 10ms}, start);
  sut.push({2}, {.delay = 10ms}, start + 1ms);
  EXPECT_EQ(sut.size(), 2U);
  EXPECT_EQ(sut.next_due(), start + 10ms);
  EXPECT_THAT(sut.take(start + 9ms), IsEmpty());
  EXPECT_THAT(sut.take(start + 10ms), ElementsAre(1));
  EXPECT_THAT(sut.take(start + 11ms), ElementsAre(2));
  EXPECT_EQ(sut.next_due(), std::nullopt);
  EXPECT_EQ(sut.size(), 0U);
}

TEST(FaultyLine, DropsEveryNthAnswer) {
  FaultyLine sut;
  for (std::uint8_t i = 1; i <= 6; ++i) {
    sut.push({i}, {.drop_every = 3}, start);
  }
  EXPECT_THAT(sut.take(start), ElementsAre(1, 2, 4, 5));
}

TEST(FaultyLine, ReordersAnswers) {
  FaultyLine sut;
  for (std::uint8_t i = 1; i <= 4; ++i) {
    sut.push({i}, {.delay = 10ms, .out_of_order = true}, start);
  }
  EXPECT_THAT(sut.take(start + 20ms), ElementsAre(2, 4, 1, 3));
}

}  // namespace
}  // namespace millrace::cnc::ads
