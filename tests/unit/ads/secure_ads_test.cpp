// A client of Secure ADS and a server, over real sockets on the loopback interface. That both are
// right, and not wrong in the same way, is for tests/interop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/barrier.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/ads/server.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/ads/memory_device.hpp"
#include "tests/unit/ads/raw_peer.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::HasSubstr;
using tests::wait_for;
using namespace std::chrono_literals;

class SecureAdsTest : public testing::Test {
 protected:
  using Connected = tl::expected<DeviceState, LinkError>;

  SecureAdsTest() {
    device.values[{1, 1}] = {1, 2, 3, 4};
    server_options.tcp_port = 0;
    server_options.security = ServerSecurity{{"millrace", "secret"}};
    options.target = server_options.session.net_id;
    options.security = Psk{"millrace", "secret"};
  }

  Connected connect() {
    server.emplace(io.get_executor(), device, server_options, base::program::no_log());
    options.tcp_port = server->tcp_port();
    sut.emplace(io.get_executor(), options);
    return wait_for(io, sut->connect());
  }
  /// Why there is no link.
  std::string refusal() {
    const auto connected = connect();
    return connected ? "connected" : connected.error().message;
  }

  boost::asio::io_context io;
  MemoryDevice device;
  ServerOptions server_options;
  ClientOptions options;
  std::optional<Server> server;
  std::optional<Client> sut;
};

TEST_F(SecureAdsTest, CarriesRequestsWithAPreSharedKey) {
  ASSERT_TRUE(connect());
  EXPECT_EQ(wait_for(io, sut->read(552, {1, 1}, 4)), (Bytes{1, 2, 3, 4}));
}

TEST_F(SecureAdsTest, CarriesLargeAnswersWhole) {
  device.values[{1, 2}] = Bytes(300'000, 7);
  ASSERT_TRUE(connect());
  EXPECT_EQ(wait_for(io, sut->read(552, {1, 2}, 300'000)), Bytes(300'000, 7));
}

TEST_F(SecureAdsTest, TakesAnIdentityInAnyCapitals) {
  options.security = Psk{"MillRace", "secret"};
  EXPECT_EQ(refusal(), "connected");
}

TEST_F(SecureAdsTest, SaysThatThePasswordIsWrong) {
  options.security = Psk{"millrace", "wrong"};
  EXPECT_THAT(refusal(), HasSubstr("the pre-shared key of identity \"millrace\" is not the "
                                   "controller's"));
}

TEST_F(SecureAdsTest, SaysThatTheIdentityIsUnknown) {
  options.security = Psk{"stranger", "secret"};
  EXPECT_THAT(refusal(), HasSubstr("does not know the identity \"stranger\""));
}

TEST_F(SecureAdsTest, SaysWhatTheControllerHasAgainstTheClient) {
  server_options.secure_faults.answer = ConnectError::version;
  EXPECT_THAT(refusal(), HasSubstr("another version of Secure ADS (TlsConnectInfo error 1"));
  server_options.secure_faults.answer = ConnectError::common_name;
  EXPECT_THAT(refusal(), HasSubstr("common name of our certificate"));
  server_options.secure_faults.answer = ConnectError::unknown_certificate;
  EXPECT_THAT(refusal(), HasSubstr("it needs a route with its fingerprint"));
  server_options.secure_faults.answer = ConnectError::unknown_user;
  EXPECT_THAT(refusal(), HasSubstr("user or password is wrong"));
}

TEST_F(SecureAdsTest, SaysThatARouteIsMissingIfTheControllerClosesAfterTheHandshake) {
  server_options.secure_faults.close_after_handshake = true;
  EXPECT_THAT(refusal(), HasSubstr("route missing"));
}

TEST_F(SecureAdsTest, SaysThatTheAnswerIsNoTlsConnectInfo) {
  server_options.secure_faults.garbage = true;
  EXPECT_THAT(refusal(), HasSubstr("is this a TwinCAT?"));
}

TEST_F(SecureAdsTest, GivesUpOnAnAnswerThatIsTooShort) {
  server_options.secure_faults.missing_bytes = 1;
  options.handshake_timeout = 100ms;
  EXPECT_THAT(refusal(), HasSubstr("no answer to TlsConnectInfo in 100 ms"));
}

TEST_F(SecureAdsTest, GivesUpOnAHandshakeThatTakesTooLong) {
  server_options.secure_faults.handshake_delay = 1min;
  options.handshake_timeout = 50ms;
  EXPECT_THAT(refusal(), HasSubstr("no TLS handshake in 50 ms"));
}

TEST_F(SecureAdsTest, SaysThatThePortMayBeTheWrongOne) {
  server_options.security.reset();
  EXPECT_THAT(refusal(), HasSubstr("is this the port of Secure ADS"));
}

TEST_F(SecureAdsTest, SaysWhatIsNeededIfNothingListens) {
  RawListener listener(io.get_executor());
  options.tcp_port = listener.tcp_port();
  listener.close();
  sut.emplace(io.get_executor(), options);
  const auto connected = wait_for(io, sut->connect());
  ASSERT_FALSE(connected);
  EXPECT_THAT(connected.error().message, HasSubstr("build 4024"));
}

TEST_F(SecureAdsTest, EndsAHandshakeThatTheClientDoesNotWaitFor) {
  RawListener silent(io.get_executor());
  options.tcp_port = silent.tcp_port();
  options.handshake_timeout = 1min;
  sut.emplace(io.get_executor(), options);
  std::optional<Connected> connected;
  boost::asio::co_spawn(io, tests::keep(sut->connect(), connected),
                        base::program::rethrow_from_loop);
  auto peer = wait_for(io, silent.accept());
  // The client's hello is there: it waits for an answer.
  wait_for(io, peer.socket().async_wait(boost::asio::ip::tcp::socket::wait_read,
                                        boost::asio::use_awaitable));
  sut->close();
  EXPECT_TRUE(tests::run_until(io, [&] { return connected.has_value(); }));
  EXPECT_THAT(connected->error().message, HasSubstr("closed while connecting"));
}

TEST_F(SecureAdsTest, ClosesAConnectionThatShakesNoHands) {
  server_options.handshake_timeout = 50ms;
  server.emplace(io.get_executor(), device, server_options, base::program::no_log());
  auto peer = wait_for(io, RawPeer::connect(server->tcp_port()));
  EXPECT_FALSE(wait_for(io, peer.receive()));
}

TEST_F(SecureAdsTest, GivesBackWhatItHasBeforeItLeaves) {
  ASSERT_TRUE(connect());
  const AddNotificationRequest wanted{{1, 1}, 4};
  std::size_t told = 0;
  const auto handles = wait_for(io, sut->subscribe(552, {wanted}, [&](auto&&...) { ++told; }));
  ASSERT_TRUE(handles.at(0));
  sut->leave({.port = 552, .notifications = {*handles[0]}});
  EXPECT_TRUE(tests::run_until(io, [&] { return server->connections() == 0; }));
}

}  // namespace
}  // namespace millrace::cnc::ads
