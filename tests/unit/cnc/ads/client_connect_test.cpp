// How a client connects and disconnects.
#include <gmock/gmock.h>

#include "tests/unit/cnc/ads/client_fixture.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

class ClientConnect : public ClientFixture {
 protected:
  LinkError failure(const Later<Connected>& connected) {
    auto result = finish(connected);
    return result ? LinkError{ErrorCode::none, "connected"} : result.error();
  }
  RawPeer connect_again() {
    auto connected = start(sut->connect());
    auto peer = accept();
    send(peer, response_to(*receive(peer), encode_state(DeviceState{5, 0})));
    EXPECT_TRUE(finish(connected));
    return peer;
  }
  std::vector<LinkError> downs;
  void watch_downs() {
    sut->on_down([this](const LinkError& why) { downs.push_back(why); });
  }
};

TEST_F(ClientConnect, IsUpAfterTheFirstAnswerAndNotBefore) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  const auto request = receive(peer);
  EXPECT_FALSE(sut->up());
  EXPECT_EQ(header_of(*request).command, Command::read_state);
  EXPECT_EQ(header_of(*request).target, (Address{options.target, 552}));
  EXPECT_EQ(header_of(*request).source, options.source);
  send(peer, response_to(*request, encode_state(DeviceState{5, 1})));
  const auto state = finish(connected);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->ads, 5);
  EXPECT_EQ(state->device, 1);
  EXPECT_TRUE(sut->up());
}

TEST_F(ClientConnect, CountsAPortWithoutReadStateAsUp) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  send(peer, response_to(*receive(peer),
                         encode_result(tl::make_unexpected(ErrorCode::service_not_supported))));
  EXPECT_EQ(finish(connected)->ads, 0);
  EXPECT_TRUE(sut->up());
}

TEST_F(ClientConnect, ReportsThatNothingListens) {
  listener.close();
  const auto why = failure(start(make_client().connect()));
  EXPECT_EQ(why.code, ErrorCode::link_down);
  EXPECT_THAT(why.message, AllOf(HasSubstr("127.0.0.1:"), HasSubstr("Connection refused"),
                                 HasSubstr("does the ADS router run there")));
}

TEST_F(ClientConnect, ReportsThatARouteIsMissingWhenClosedAfterAccept) {
  auto connected = start(make_client().connect());
  accept().close();
  const auto why = failure(connected);
  EXPECT_EQ(why.code, ErrorCode::link_lost);
  EXPECT_THAT(why.message, AllOf(HasSubstr("route missing"), HasSubstr("before the first answer"),
                                 HasSubstr("from NetId 127.0.0.1.2.1 to 127.0.0.1")));
}

TEST_F(ClientConnect, ReportsThatARouteIsMissingWhenClosedUponTheFirstRequest) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  receive(peer);
  peer.close();
  EXPECT_THAT(failure(connected).message, HasSubstr("route missing"));
}

TEST_F(ClientConnect, ReportsThatAControllerAcceptsButStaysSilent) {
  options.timeout = 20ms;
  auto connected = start(make_client().connect());
  auto peer = accept();
  const auto why = failure(connected);
  EXPECT_EQ(why.code, ErrorCode::timeout);
  EXPECT_THAT(why.message, AllOf(HasSubstr("accepted the connection but does not answer"),
                                 HasSubstr("is 127.0.0.1.1.1 its NetId")));
  EXPECT_FALSE(sut->up());
  receive(peer);
  EXPECT_EQ(receive(peer), std::nullopt) << "the connection is closed";
}

TEST_F(ClientConnect, ReportsThatTheCncDoesNotRun) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  send(peer, response_to(*receive(peer), {}, ErrorCode::target_port_not_found));
  EXPECT_THAT(failure(connected).message, HasSubstr("nothing serves its AMS port 552"));
}

TEST_F(ClientConnect, ReportsThatTheNetIdIsUnknown) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  send(peer, response_to(*receive(peer), {}, ErrorCode::target_machine_not_found));
  EXPECT_THAT(failure(connected).message, HasSubstr("does not know NetId 127.0.0.1.1.1"));
}

TEST_F(ClientConnect, ReportsThatThePeerDoesNotSpeakAds) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  const std::string http = "HTTP/1.1 400 Bad Request\r\n\r\n";
  send(peer, Bytes(http.begin(), http.end()));
  const auto why = failure(connected);
  EXPECT_EQ(why.code, ErrorCode::protocol_error);
  EXPECT_THAT(why.message, HasSubstr("is this the port of an ADS router?"));
}

TEST_F(ClientConnect,
       SuspectsAnotherClientOnlyIfTheControllerAcceptsConnectionsAndClosesThemAgain) {
  auto peer = establish();
  watch_downs();
  peer.close();
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
  EXPECT_EQ(downs[0].code, ErrorCode::link_lost);
  EXPECT_THAT(downs[0].message, EndsWith("closed the connection (End of file)"));
  EXPECT_FALSE(sut->up());
  // A virtual CNC is restarted as fast, a few times.
  for (std::size_t i = 1; i < 4; ++i) {
    connect_again().close();
    ASSERT_TRUE(tests::run_until(io, [&] { return downs.size() == i + 1; }));
    EXPECT_THAT(downs[i].message, EndsWith("closed the connection (End of file)"));
  }
  connect_again().close();
  ASSERT_TRUE(tests::run_until(io, [&] { return downs.size() == 5; }));
  EXPECT_THAT(downs[4].message, HasSubstr("another ADS client on this host?"));
}

TEST_F(ClientConnect, SuspectsNoOtherClientOfAControllerThatAcceptsTheNextConnectionLater) {
  options.timeout = 1s;
  auto peer = establish();
  watch_downs();
  peer.close();
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
  const auto restarted = std::chrono::steady_clock::now() + options.timeout / 3;
  ASSERT_TRUE(tests::run_until(io, [&] { return std::chrono::steady_clock::now() > restarted; }));
  connect_again().close();
  ASSERT_TRUE(tests::run_until(io, [&] { return downs.size() == 2; }));
  EXPECT_THAT(downs[1].message, EndsWith("closed the connection (End of file)"));
}

TEST_F(ClientConnect, SuspectsNoOtherClientOfAControllerThatWasRestarted) {
  auto peer = establish();
  watch_downs();
  const auto port = listener.tcp_port();
  listener.close();
  peer.close();
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
  EXPECT_EQ(failure(start(sut->connect())).code, ErrorCode::link_down) << "it refuses for a while";
  listener.listen(port);
  connect_again().close();
  ASSERT_TRUE(tests::run_until(io, [&] { return downs.size() == 2; }));
  EXPECT_THAT(downs[1].message, EndsWith("closed the connection (End of file)"));
}

TEST_F(ClientConnect, FailsEverythingPendingTheMomentTheLinkEnds) {
  auto peer = establish();
  watch_downs();
  auto first = start_read();
  auto second = start(sut->write(552, {1, 1}, {1}));
  receive(peer);
  peer.close();
  EXPECT_EQ(finish(first).error(), ErrorCode::link_lost);
  EXPECT_EQ(finish(second).error(), ErrorCode::link_lost);
  EXPECT_THAT(downs, SizeIs(1));
}

TEST_F(ClientConnect, EndsTheLinkForAnImpossibleLength) {
  auto peer = establish();
  watch_downs();
  auto read = start_read();
  send(peer, {0, 0, 0xFF, 0xFF, 0xFF, 0xFF});
  EXPECT_EQ(finish(read).error(), ErrorCode::link_lost);
  ASSERT_THAT(downs, SizeIs(1));
  EXPECT_THAT(downs[0].message, HasSubstr("announces 4294967295 bytes"));
}

TEST_F(ClientConnect, GivesUpAConnectionThatDoesNotAnswerARequestWhateverElseItSends) {
  options.timeout = 300ms;
  auto peer = establish();
  watch_downs();
  auto read = start_read();
  const Bytes request = *receive(peer);
  const Address router{options.target, 10000};
  const Address device{options.target, 552};
  Bytes frames = request;
  for (const auto& [from, command] :
       {std::pair(router, Command::read_state), {device, Command::notification}}) {
    const Bytes frame = encode_packet(
        {options.source, from, command, flags::ads_command, ErrorCode::none, 77}, Bytes(12, 0));
    frames.insert(frames.end(), frame.begin(), frame.end());
  }
  send(peer, frames);
  EXPECT_EQ(finish(read).error(), ErrorCode::timeout);
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
  EXPECT_FALSE(sut->up());
  EXPECT_THAT(downs[0].message, HasSubstr("does not answer: no response for 0."));
  EXPECT_GE(downs[0].silent_for, 300ms);
  EXPECT_EQ(sut->counters().notifications, 1U);
}

TEST_F(ClientConnect, GivesUpAConnectionWhoseRouterHasNoCncForATimeout) {
  // Longer than a busy host lets a response wait.
  options.timeout = 2s;
  auto peer = establish();
  watch_downs();
  int refused = 0;
  while (downs.empty()) {
    auto read = start_read();
    const auto request = receive(peer);
    ASSERT_TRUE(request);
    send(peer, response_to(*request, {}, ErrorCode::target_port_not_found));
    EXPECT_EQ(finish(read).error(), ErrorCode::target_port_not_found);
    ++refused;
  }
  EXPECT_GE(refused, 2) << "a CNC that restarts may refuse a few requests";
  EXPECT_FALSE(sut->up());
  EXPECT_EQ(downs[0].code, ErrorCode::target_port_not_found);
  EXPECT_THAT(downs[0].message,
              HasSubstr("answers, but nothing serves its AMS port 552: does the CNC run?"));
  EXPECT_GE(downs[0].silent_for, 2s);
}

TEST_F(ClientConnect, NamesTheErrorOfARouterThatDoesNotReachTheCnc) {
  auto connected = start(make_client().connect());
  auto peer = accept();
  send(peer, response_to(*receive(peer), {}, ErrorCode{0x1B}));
  EXPECT_THAT(failure(connected).message,
              HasSubstr("its router does not reach AMS port 552: 0x1b host unreachable"));
}

TEST_F(ClientConnect, KeepsAConnectionThatHasAnsweredALaterRequest) {
  options.timeout = 1s;
  auto peer = establish();
  watch_downs();
  auto lost = start_read();
  receive(peer);
  auto answered = start_read();
  send(peer, response_to(*receive(peer), encode_data(Bytes{1})));
  EXPECT_TRUE(finish(answered));
  EXPECT_EQ(finish(lost).error(), ErrorCode::timeout);
  // The examination of the time-out is over before the next one begins.
  auto next = start_read();
  receive(peer);
  EXPECT_TRUE(sut->up());
  EXPECT_THAT(downs, IsEmpty());
  EXPECT_EQ(finish(next).error(), ErrorCode::timeout);
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
}

TEST_F(ClientConnect, KeepsAConnectionWhoseResponseIsLateOnceButNotOneThatIsAlwaysLate) {
  options.timeout = 200ms;
  auto peer = establish();
  watch_downs();
  int late = 0;
  while (downs.empty()) {
    auto read = start_read();
    const auto request = receive(peer);
    ASSERT_TRUE(request);
    EXPECT_FALSE(finish(read));
    send(peer, response_to(*request, encode_data(Bytes{1})));
    ASSERT_TRUE(tests::run_until(
        io, [&] { return !downs.empty() || sut->counters().late > static_cast<unsigned>(late); }));
    ++late;
  }
  EXPECT_GE(late, 3);
  EXPECT_THAT(downs[0].message, HasSubstr("answers too late: no response within 200 ms for 0."));
}

TEST_F(ClientConnect, RepeatsNothingOnTheNextLink) {
  {
    auto peer = establish();
    auto write = start(sut->write(552, {1, 1}, {1}));
    receive(peer);
    peer.close();
    EXPECT_EQ(finish(write).error(), ErrorCode::link_lost);
  }
  auto connected = start(sut->connect());
  auto peer = accept();
  const auto first = receive(peer);
  EXPECT_EQ(header_of(*first).command, Command::read_state);
  send(peer, response_to(*first, encode_state(DeviceState{5, 0})));
  EXPECT_TRUE(finish(connected));
  auto read = start_read();
  const auto second = receive(peer);
  EXPECT_EQ(header_of(*second).command, Command::read);
  send(peer, response_to(*second, encode_data(Bytes{1})));
  EXPECT_EQ(*finish(read), Bytes{1});
}

/// Reads all that comes, until the connection ends.
boost::system::error_code end_of(RawPeer& peer) {
  boost::system::error_code error;
  Bytes chunk(65536);
  while (!error) {
    peer.socket().read_some(boost::asio::buffer(chunk), error);
  }
  return error;
}

TEST_F(ClientConnect, DropsWhatAControllerHasNotReceivedWhenItGivesUpTheConnection) {
  options.timeout = 300ms;
  auto peer = establish();
  watch_downs();
  std::vector<Later<Result<void>>> writes;
  for (int i = 0; i < 40; ++i) {  // more than the buffers of both ends hold
    writes.push_back(start(sut->write(552, {1, 1}, Bytes(std::size_t{1} << 20U))));
  }
  ASSERT_TRUE(tests::run_until(io, [&] { return !downs.empty(); }));
  EXPECT_EQ(end_of(peer), boost::asio::error::connection_reset)
      << "the rest would arrive beside the requests of the next connection";
}

TEST_F(ClientConnect, ClosesAConnectionInOrderWhoseRequestsHaveArrived) {
  auto peer = establish();
  sut->close();
  EXPECT_EQ(end_of(peer), boost::asio::error::eof);
}

TEST_F(ClientConnect, RefusesRequestsWhileItIsNotUp) {
  make_client();
  EXPECT_EQ(finish(start_read()).error(), ErrorCode::link_down);
  auto connected = start(sut->connect());
  auto peer = accept();
  EXPECT_EQ(finish(start_read()).error(), ErrorCode::link_down);
  EXPECT_EQ(sut->counters().requests, 1U);
}

TEST_F(ClientConnect, RefusesASecondConnect) {
  const auto peer = establish();
  EXPECT_EQ(failure(start(sut->connect())).code, ErrorCode::invalid_state);
  EXPECT_TRUE(sut->up());
}

TEST_F(ClientConnect, CloseEndsPendingRequestsAndReportsNoLostLink) {
  auto peer = establish();
  watch_downs();
  auto read = start_read();
  receive(peer);
  sut->close();
  EXPECT_FALSE(sut->up());
  EXPECT_EQ(finish(read).error(), ErrorCode::link_lost);
  EXPECT_EQ(receive(peer), std::nullopt);
  EXPECT_THAT(downs, IsEmpty());
}

TEST_F(ClientConnect, CloseEndsAConnectThatIsUnderWay) {
  auto connected = start(make_client().connect());
  sut->close();
  io.poll();
  sut->close();
  const auto why = failure(connected);
  EXPECT_THAT(why.message, HasSubstr("closed while connecting"));
}

TEST_F(ClientConnect, MayBeDestroyedWhileRequestsArePending) {
  auto peer = establish();
  auto read = start_read();
  receive(peer);
  sut.reset();
  EXPECT_EQ(finish(read).error(), ErrorCode::link_lost);
}

}  // namespace
}  // namespace millrace::cnc::ads
