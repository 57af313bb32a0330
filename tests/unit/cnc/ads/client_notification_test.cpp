// Notifications from controllers of several kinds to a client.
#include <gmock/gmock.h>

#include "cnc/ads/server.hpp"
#include "cnc/ads/subscriptions.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/unit/cnc/ads/client_fixture.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Pair;
using Handles = std::vector<Result<std::uint32_t>>;

constexpr std::uint32_t ms = 10'000;  // on the wire, in 100 ns

class ClientNotification : public ClientFixture {
 protected:
  void serve(ServerOptions server_options = {}) {
    device.values[{1, 1}] = {1};
    device.values[{1, 2}] = {2};
    server_options.tcp_port = 0;
    server.emplace(io.get_executor(), device, server_options, base::program::no_log());
    options.tcp_port = server->tcp_port();
    ASSERT_TRUE(finish(start(make_client().connect())));
  }
  static std::vector<AddNotificationRequest> both() {
    return {{{1, 1}, 1, Transmission::on_change, 0, ms},
            {{1, 2}, 1, Transmission::on_change, 0, ms}};
  }
  Handles subscribe(std::vector<AddNotificationRequest> wanted = both()) {
    return finish(start(sut->subscribe(552, std::move(wanted), record)));
  }
  /// A controller that has granted the handles 7 and 8.
  RawPeer subscribe_to_peer() {
    auto peer = establish();
    const auto later = start(sut->subscribe(552, both(), record));
    const Bytes granted = ByteWriter().u32(0).u32(7).u32(0).u32(8).take();
    send(peer, response_to(*receive(peer), encode_data(granted)));
    finish(later);
    return peer;
  }
  void unsubscribe(std::vector<std::uint32_t> handles) {
    bool done = false;
    boost::asio::co_spawn(io, sut->unsubscribe(552, std::move(handles)),
                          [&](std::exception_ptr) { done = true; });
    ASSERT_TRUE(tests::run_until(io, [&] { return done; }));
  }
  bool is_notified(std::size_t item, std::uint8_t value) {
    return tests::run_until(
        io, [&] { return std::ranges::count(notified, std::pair(item, Bytes{value})) > 0; });
  }

  MemoryDevice device;
  std::optional<Server> server;
  std::vector<std::pair<std::size_t, Bytes>> notified;
  NotificationHandler record = [this](std::size_t item, BytesView value) {
    notified.emplace_back(item, Bytes(value.begin(), value.end()));
  };
};

TEST_F(ClientNotification, PassesTheFirstValueAndEachChange) {
  serve();
  const auto before = sut->counters().requests;
  const Handles handles = subscribe();
  EXPECT_TRUE(handles[0] && handles[1]);
  EXPECT_EQ(sut->counters().requests, before + 1) << "all in one sum";
  EXPECT_TRUE(is_notified(0, 1) && is_notified(1, 2));
  device.values[{1, 2}] = {5};
  EXPECT_TRUE(is_notified(1, 5));
}

TEST_F(ClientNotification, ReportsWhichOneIsRefused) {
  serve();
  auto wanted = both();
  wanted[0].index = {9, 9};
  const Handles handles = subscribe(wanted);
  EXPECT_EQ(handles[0].error(), ErrorCode::invalid_group);
  EXPECT_TRUE(handles[1]);
  EXPECT_TRUE(is_notified(1, 2));
}

TEST_F(ClientNotification, SubscribesOneByOneWhereTheControllerHasNoSumCommands) {
  auto peer = establish();
  const auto later = start(sut->subscribe(552, both(), record));
  const Bytes sum = *receive(peer);
  EXPECT_EQ(header_of(sum).command, Command::read_write);
  send(peer, response_to(sum, encode_data(tl::make_unexpected(ErrorCode::invalid_group))));
  for (const std::uint32_t handle : {7U, 8U}) {
    const Bytes bytes = *receive(peer);
    EXPECT_EQ(header_of(bytes).command, Command::add_notification);
    send(peer, response_to(bytes, encode_handle(handle)));
  }
  EXPECT_THAT(finish(later), ElementsAre(Result<std::uint32_t>(7), Result<std::uint32_t>(8)));
}

TEST_F(ClientNotification, StopsWhereTheControllerSupportsNoNotifications) {
  auto peer = establish();
  const auto later = start(sut->subscribe(552, both(), record));
  for (const auto command : {Command::read_write, Command::add_notification}) {
    const Bytes request = *receive(peer);
    EXPECT_EQ(header_of(request).command, command);
    const auto no = tl::make_unexpected(ErrorCode::service_not_supported);
    send(peer, response_to(request,
                           command == Command::read_write ? encode_data(no) : encode_handle(no)));
  }
  const Handles handles = finish(later);
  ASSERT_EQ(handles.size(), 2U);
  EXPECT_EQ(handles[1].error(), ErrorCode::service_not_supported);
}

TEST_F(ClientNotification, GetsNothingAfterUnsubscribingAndLeavesNothingBehind) {
  serve();
  const Handles handles = subscribe();
  ASSERT_TRUE(is_notified(0, 1));
  unsubscribe({*handles[0], *handles[1]});
  notified.clear();
  device.values[{1, 1}] = {9};
  const auto before = sut->counters().notifications;
  ASSERT_TRUE(finish(start(sut->read(552, {1, 1}, 1))));
  tests::run_until(
      io, [] { return false; }, std::chrono::milliseconds(20));
  EXPECT_TRUE(notified.empty());
  EXPECT_EQ(sut->counters().notifications, before);
}

TEST_F(ClientNotification, DeletesWhatAnEarlierConnectionHasLeftAtTheController) {
  ServerOptions survive;
  survive.notifications_survive = true;
  serve(survive);
  subscribe({{{1, 1}, 1, Transmission::cyclic, 0, ms}});
  ASSERT_TRUE(is_notified(0, 1));
  sut->close();
  ASSERT_TRUE(tests::run_until(io, [&] { return server->connections() == 0; }));
  notified.clear();
  ASSERT_TRUE(finish(start(sut->connect())));
  // They arrive and are deleted; then no further ones arrive.
  ASSERT_TRUE(tests::run_until(io, [&] { return sut->counters().notifications > 2; }));
  std::uint64_t seen = 0;
  EXPECT_TRUE(tests::run_until(io, [&] {
    const auto before = std::exchange(seen, sut->counters().notifications);
    tests::run_until(
        io, [] { return false; }, std::chrono::milliseconds(20));
    return before == sut->counters().notifications;
  }));
  EXPECT_TRUE(notified.empty());
}

TEST_F(ClientNotification, PassesNothingOnceTheUnsubscriptionHasBegun) {
  auto peer = subscribe_to_peer();
  bool done = false;
  boost::asio::co_spawn(io, sut->unsubscribe(552, {7}), [&](std::exception_ptr) { done = true; });
  const Bytes deletion = *receive(peer);
  const Header header{options.source,     {options.target, 552}, Command::notification,
                      flags::ads_command, ErrorCode::none,       0};
  const Bytes value{3};
  send(peer, encode_packet(header, encode_notification({{0, {{7, value}, {8, value}}}})));
  EXPECT_TRUE(is_notified(1, 3));
  EXPECT_THAT(notified, testing::Not(Contains(Pair(0, testing::_))));
  send(peer, response_to(deletion, encode_data(ByteWriter().u32(0).take())));
  EXPECT_TRUE(tests::run_until(io, [&] { return done; }));
}

TEST_F(ClientNotification, ReleasesWhatTheControllerKeepsForItWhenItLeaves) {
  auto peer = subscribe_to_peer();
  sut->leave({.port = 552, .notifications = {7, 8}, .symbols = {3}});
  const Bytes deletion = *receive(peer);
  EXPECT_EQ(header_of(deletion).command, Command::read_write);
  EXPECT_TRUE(std::ranges::equal(BytesView(deletion).last(8), Bytes{7, 0, 0, 0, 8, 0, 0, 0}));
  const Bytes release = *receive(peer);
  EXPECT_EQ(header_of(release).command, Command::write);
  EXPECT_TRUE(std::ranges::equal(BytesView(release).last(4), Bytes{3, 0, 0, 0}));
  EXPECT_EQ(receive(peer), std::nullopt) << "the connection is closed";
}

TEST_F(ClientNotification, OneThatEndsWithItsLinkFails) {
  auto peer = establish();
  const auto later = start(sut->subscribe(552, both(), record));
  receive(peer);
  peer.close();
  const Handles handles = finish(later);
  ASSERT_EQ(handles.size(), 2U);
  EXPECT_EQ(handles[0].error(), ErrorCode::link_lost);
}

TEST_F(ClientNotification, OneThatTimesOutIsDeletedWhenTheControllerNotifiesItAfterAll) {
  options.timeout = std::chrono::milliseconds(300);
  auto peer = establish();
  const auto later = start(sut->subscribe(552, both(), record));
  const Bytes sum = *receive(peer);
  auto read = start_read();
  send(peer, response_to(*receive(peer), encode_data(Bytes{1})));  // keeps the connection
  EXPECT_TRUE(finish(read));
  const Header header{options.source,     {options.target, 552}, Command::notification,
                      flags::ads_command, ErrorCode::none,       0};
  const Bytes value{3};
  const Bytes notification = encode_packet(header, encode_notification({{0, {{7, value}}}}));
  const Handles handles = finish(later);
  EXPECT_EQ(handles[0].error(), ErrorCode::timeout);
  const Bytes granted = ByteWriter().u32(0).u32(7).u32(0).u32(8).take();
  Bytes late = response_to(sum, encode_data(granted));
  late.insert(late.end(), notification.begin(), notification.end());
  send(peer, late);
  const auto deletion = receive(peer);
  ASSERT_TRUE(deletion);
  EXPECT_EQ(header_of(*deletion).command, Command::read_write);
  EXPECT_TRUE(std::ranges::equal(BytesView(*deletion).last(4), Bytes{7, 0, 0, 0}));
  EXPECT_TRUE(notified.empty());
}

TEST_F(ClientNotification, AnInconsistentFrameIsDropped) {
  auto peer = subscribe_to_peer();
  const Header header{options.source,     {options.target, 552}, Command::notification,
                      flags::ads_command, ErrorCode::none,       0};
  Bytes cut = encode_notification({{0, {{7, Bytes{1}}}}});
  cut.resize(cut.size() - 1);
  send(peer, encode_packet(header, cut));
  const Bytes value{3};
  send(peer, encode_packet(header, encode_notification({{0, {{8, value}}}})));
  EXPECT_TRUE(is_notified(1, 3));
  EXPECT_THAT(notified, testing::Not(Contains(Pair(0, testing::_))));
  EXPECT_TRUE(sut->up());
}

}  // namespace
}  // namespace millrace::cnc::ads
