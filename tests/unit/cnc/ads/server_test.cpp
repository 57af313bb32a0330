#include "cnc/ads/server.hpp"

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/barrier.hpp"
#include "cnc/ads/response.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"
#include "tests/unit/cnc/ads/raw_peer.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;
using tests::run_until;
using tests::wait_for;

class ServerTest : public testing::Test {
 protected:
  ServerTest() { device.values[{0x122301, 0x48}] = {1, 0, 0, 0}; }

  static Bytes vector(const std::string& name) { return tests::hex_vector("ads/frames.hex", name); }
  Server& start(ServerOptions options = {}) {
    options.tcp_port = 0;
    return sut.emplace(io.get_executor(), device, options, base::program::no_log());
  }
  RawPeer connect() { return wait_for(io, RawPeer::connect(sut->tcp_port())); }
  void send(RawPeer& peer, Bytes bytes) { wait_for(io, peer.send(std::move(bytes))); }
  std::optional<Bytes> receive(RawPeer& peer) { return wait_for(io, peer.receive()); }
  /// A peer that requests a megabyte that often and reads nothing.
  RawPeer connect_and_read_nothing(int requests) {
    device.values[{0x122301, 0x48}] = Bytes(1'000'000);
    auto greedy = connect();
    auto request = vector("read_request");
    request[46] = request[47] = request[48] = request[49] = 0x7F;  // the length to read
    // In one segment: the server may close the connection between two.
    Bytes segment;
    for (int i = 0; i < requests; ++i) {
      segment.insert(segment.end(), request.begin(), request.end());
    }
    send(greedy, segment);
    return greedy;
  }

  asio::io_context io;
  MemoryDevice device;
  std::optional<Server> sut;
};

TEST_F(ServerTest, ExecutesEachOfAHundredRequestsInOneSegmentOnce) {
  start();
  auto peer = connect();
  Bytes segment;
  for (int i = 0; i < 100; ++i) {
    const auto request = vector("read_request");
    segment.insert(segment.end(), request.begin(), request.end());
  }
  send(peer, segment);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(receive(peer), vector("read_response"));
  }
  EXPECT_EQ(device.calls, 100);
}

TEST_F(ServerTest, ClosesOnlyTheConnectionThatBreaksTheProtocol) {
  start();
  auto good = connect();
  for (const auto* broken : {"announces_4_gib", "too_short_for_ams", "lengths_disagree", "http"}) {
    auto bad = connect();
    send(bad, vector(broken));
    EXPECT_EQ(receive(bad), std::nullopt) << broken;
  }
  send(good, vector("read_request"));
  EXPECT_EQ(receive(good), vector("read_response"));
  EXPECT_TRUE(run_until(io, [&] { return sut->connections() == 1; }));
}

// Requests ten times what a socket and the server may buffer, and reads none of it.
TEST_F(ServerTest, DoesNotReadFromAPeerThatReadsNothing) {
  ServerOptions options;
  options.max_output = 10'000;
  start(options);
  const auto greedy = connect_and_read_nothing(200);
  auto other = connect();
  send(other, vector("read_request"));
  EXPECT_EQ(receive(other)->size(), 50U);
  EXPECT_LT(device.calls, 20);
}

TEST_F(ServerTest, ContinuesWhenAPeerReadsAgain) {
  ServerOptions options;
  options.max_output = 100;
  start(options);
  auto peer = connect();
  for (int i = 0; i < 1000; ++i) {
    send(peer, vector("read_request"));
  }
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(receive(peer), vector("read_response"));
  }
}

TEST_F(ServerTest, RefusesOneConnectionTooManyAndDisturbsNoOther) {
  ServerOptions options;
  options.max_connections = 2;
  start(options);
  auto first = connect();
  auto second = connect();
  for (auto* peer : {&first, &second}) {
    send(*peer, vector("read_request"));
    ASSERT_EQ(receive(*peer), vector("read_response"));
  }
  auto third = connect();
  EXPECT_EQ(receive(third), std::nullopt);
  for (auto* peer : {&first, &second}) {
    send(*peer, vector("read_request"));
    EXPECT_EQ(receive(*peer), vector("read_response"));
  }
}

TEST_F(ServerTest, ClosesTheOldestHalfFrameForAClientAndNoClient) {
  ServerOptions options;
  options.max_connections = 3;
  start(options);
  auto client = connect();
  send(client, vector("read_request"));
  ASSERT_EQ(receive(client), vector("read_response"));
  const Bytes request = vector("read_request");
  const Bytes half(request.begin(), request.begin() + 20);
  auto oldest = connect();
  send(oldest, half);
  auto other = connect();
  send(other, half);
  auto newer = connect();
  EXPECT_EQ(receive(oldest), std::nullopt);
  for (auto* peer : {&client, &newer}) {
    send(*peer, request);
    EXPECT_EQ(receive(*peer), vector("read_response"));
  }
}

TEST_F(ServerTest, ServesANewConnectionWhenOneOfTooManyHasLeft) {
  ServerOptions options;
  options.max_connections = 1;
  start(options);
  auto first = connect();
  ASSERT_TRUE(run_until(io, [&] { return sut->connections() == 1; }));
  first.close();
  ASSERT_TRUE(run_until(io, [&] { return sut->connections() == 0; }));
  auto second = connect();
  send(second, vector("read_request"));
  EXPECT_EQ(receive(second), vector("read_response"));
}

TEST_F(ServerTest, AConnectionThatReplacesTheOldestOfItsAddressIsNotOneTooMany) {
  ServerOptions options;
  options.max_connections = 1;
  options.one_connection_per_address = true;
  start(options);
  auto first = connect();
  ASSERT_TRUE(run_until(io, [&] { return sut->connections() == 1; }));
  auto second = connect();
  send(second, vector("read_request"));
  EXPECT_EQ(receive(second), vector("read_response"));
  EXPECT_EQ(receive(first), std::nullopt);
}

TEST_F(ServerTest, ClosesAConnectionThatIsNotUsedAndNoneThatIs) {
  ServerOptions options;
  options.idle_time = std::chrono::milliseconds(300);
  start(options);
  const auto begin = std::chrono::steady_clock::now();
  auto used = connect();
  auto unused = connect();
  std::optional<std::optional<Bytes>> end;
  asio::co_spawn(io, tests::keep(unused.receive(), end), base::program::rethrow_from_loop);
  while (!end) {
    ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
    send(used, vector("read_request"));
    ASSERT_EQ(receive(used), vector("read_response"));
  }
  EXPECT_EQ(*end, std::nullopt);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, options.idle_time);
  EXPECT_EQ(sut->connections(), 1U);
}

TEST_F(ServerTest, AClientThatWaitsForNotificationsIsNotIdle) {
  ServerOptions options;
  options.idle_time = std::chrono::milliseconds(50);
  start(options);
  auto peer = connect();
  auto add = decode_packet(BytesView(vector("read_request")).subspan(frame_header_size))->header;
  add.command = Command::add_notification;
  send(peer, encode_packet(add, encode(AddNotificationRequest{
                                    {0x122301, 0x48}, 4, Transmission::on_change, 0, 10'000})));
  ASSERT_TRUE(receive(peer));  // the handle
  ASSERT_TRUE(receive(peer));  // the first value
  auto unused = connect();
  EXPECT_EQ(receive(unused), std::nullopt);  // connected later and already closed
  EXPECT_EQ(sut->connections(), 1U);
  device.values[{0x122301, 0x48}] = {2, 0, 0, 0};
  EXPECT_TRUE(receive(peer));
}

TEST_F(ServerTest, ClosesAConnectionWhosePeerReadsNothingForTheIdleTime) {
  ServerOptions options;
  options.idle_time = std::chrono::milliseconds(100);
  start(options);
  const auto greedy = connect_and_read_nothing(20);
  ASSERT_TRUE(run_until(io, [&] { return device.calls > 1; }));
  EXPECT_TRUE(run_until(io, [&] { return sut->connections() == 0; }));
}

TEST_F(ServerTest, IsDrainedWhenWhatItHasAnsweredHasLeft) {
  start({.faults = {.delay = std::chrono::milliseconds(30)}});
  auto peer = connect();
  send(peer, vector("read_request"));
  ASSERT_TRUE(run_until(io, [&] { return device.calls == 1; }));
  std::optional<bool> drained;
  sut->drain(std::chrono::seconds(10), [&](bool all) {
    drained = all;
    sut->stop();
  });
  EXPECT_EQ(receive(peer), vector("read_response"));
  EXPECT_EQ(receive(peer), std::nullopt);
  EXPECT_EQ(drained, true);
}

TEST_F(ServerTest, IsDrainedAtOnceWithoutConnections) {
  start();
  std::optional<bool> drained;
  sut->drain(std::chrono::seconds(10), [&](bool all) { drained = all; });
  EXPECT_TRUE(run_until(io, [&] { return drained.has_value(); }));
  EXPECT_EQ(drained, true);
}

TEST_F(ServerTest, WaitsNoLongerThanTheLimitForAPeerThatReadsNothing) {
  start();
  const auto greedy = connect_and_read_nothing(20);
  ASSERT_TRUE(run_until(io, [&] { return device.calls > 1; }));
  std::optional<bool> drained;
  sut->drain(std::chrono::milliseconds(20), [&](bool all) { drained = all; });
  EXPECT_TRUE(run_until(io, [&] { return drained.has_value(); }));
  EXPECT_EQ(drained, false);
}

TEST_F(ServerTest, StopsWithItsConnections) {
  start();
  auto peer = connect();
  send(peer, vector("read_request"));
  receive(peer);
  sut->stop();
  EXPECT_EQ(receive(peer), std::nullopt);
  sut.reset();
  io.restart();
  io.run();  // returns: no coroutine is left
}

TEST_F(ServerTest, SendsANotificationBehindTheAnswerThatAnnouncesIt) {
  start();
  auto peer = connect();
  const auto header =
      decode_packet(BytesView(vector("read_request")).subspan(frame_header_size))->header;
  auto add = header;
  add.command = Command::add_notification;
  const AddNotificationRequest wanted{{0x122301, 0x48}, 4, Transmission::cyclic, 0, 10'000};
  send(peer, encode_packet(add, encode(wanted)));
  const auto answer = receive(peer);
  EXPECT_EQ(decode_handle(BytesView(*answer).subspan(38)), 1U);
  for (int i = 0; i < 3; ++i) {
    const auto frame = receive(peer);
    const auto packet = decode_packet(BytesView(*frame).subspan(frame_header_size));
    EXPECT_EQ(packet->header.command, Command::notification);
    EXPECT_EQ(packet->header.target, header.source);
    const auto stamps = decode_notification(packet->data);
    ASSERT_TRUE(stamps);
    EXPECT_EQ(stamps->at(0).samples.at(0).data.size(), 4U);
  }
  peer.close();
  EXPECT_TRUE(run_until(io, [&] { return sut->connections() == 0; }));
  const auto calls = device.calls;
  auto other = connect();
  send(other, vector("read_request"));
  EXPECT_EQ(receive(other), vector("read_response"));
  EXPECT_EQ(device.calls, calls + 1) << "no subscription is left to sample";
}

TEST_F(ServerTest, ClosesTheConnectionOfAClientThatReleasesItsPortAfterItsAnswers) {
  start();
  auto peer = connect();
  Bytes all = vector("read_request");
  const Bytes close = encode_frame(FrameKind::port_close, Bytes{0x00, 0x80});
  all.insert(all.end(), close.begin(), close.end());
  send(peer, all);
  EXPECT_EQ(receive(peer), vector("read_response"));
  EXPECT_EQ(receive(peer), std::nullopt);
}

TEST_F(ServerTest, ReportsWhyItCannotListen) {
  start();
  ServerOptions options;
  options.tcp_port = sut->tcp_port();
  try {
    Server second(io.get_executor(), device, options, base::program::no_log());
    FAIL() << "two servers listen on one port";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot listen on 127.0.0.1:"));
    EXPECT_THAT(error.what(), HasSubstr("Address already in use"));
  }
}

}  // namespace
}  // namespace millrace::cnc::ads
