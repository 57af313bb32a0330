// A Secure ADS client and a server, over real sockets on the loopback interface. tests/interop
// checks that both do not share the same mistake.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/program/barrier.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/ads/server.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"
#include "tests/unit/cnc/ads/raw_peer.hpp"

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
    server_options.security = ServerSecurity{.psk = Psk{"millrace", "secret"}};
    options.target = server_options.session.net_id;
    options.security = Psk{"millrace", "secret"};
  }

  Connected connect() {
    server.emplace(io.get_executor(), device, server_options, base::program::no_log());
    options.tcp_port = server->tcp_port();
    sut.emplace(io.get_executor(), options);
    return wait_for(io, sut->connect());
  }
  /// Why the connection failed.
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

TEST_F(SecureAdsTest, IgnoresTheCaseOfAnIdentity) {
  options.security = Psk{"MillRace", "secret"};
  EXPECT_EQ(refusal(), "connected");
}

TEST_F(SecureAdsTest, ReportsThatThePasswordIsWrong) {
  options.security = Psk{"millrace", "wrong"};
  EXPECT_THAT(refusal(), HasSubstr("the pre-shared key of identity \"millrace\" is not the "
                                   "controller's"));
}

TEST_F(SecureAdsTest, ReportsThatTheIdentityIsUnknown) {
  options.security = Psk{"stranger", "secret"};
  EXPECT_THAT(refusal(), HasSubstr("does not know the identity \"stranger\""));
}

TEST_F(SecureAdsTest, ReportsWhyTheControllerRefusesTheClient) {
  server_options.secure_faults.answer = ConnectError::version;
  EXPECT_THAT(refusal(), HasSubstr("another version of Secure ADS (TlsConnectInfo error 1"));
  server_options.secure_faults.answer = ConnectError::common_name;
  EXPECT_THAT(refusal(), HasSubstr("common name of our certificate"));
  server_options.secure_faults.answer = ConnectError::unknown_certificate;
  EXPECT_THAT(refusal(), HasSubstr("it needs a route with its fingerprint"));
  server_options.secure_faults.answer = ConnectError::unknown_user;
  EXPECT_THAT(refusal(), HasSubstr("user or password is wrong"));
}

TEST_F(SecureAdsTest, ReportsThatARouteIsMissingIfTheControllerClosesAfterTheHandshake) {
  server_options.secure_faults.close_after_handshake = true;
  EXPECT_THAT(refusal(), HasSubstr("route missing"));
}

TEST_F(SecureAdsTest, ReportsThatTheAnswerIsNoTlsConnectInfo) {
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

TEST_F(SecureAdsTest, ReportsTooManyConnectionsInAShortTime) {
  server_options.secure_faults.least_pause = 1h;
  ASSERT_TRUE(connect());
  Client next(io.get_executor(), options);
  const auto connected = wait_for(io, next.connect());
  ASSERT_FALSE(connected);
  EXPECT_THAT(connected.error().message, HasSubstr("many connections in a short time"));
}

TEST_F(SecureAdsTest, ReportsThatThePortMayBeTheWrongOne) {
  server_options.security.reset();
  EXPECT_THAT(refusal(), HasSubstr("is this the port of Secure ADS"));
}

TEST_F(SecureAdsTest, ReportsWhatIsNeededIfNothingListens) {
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
  // The client's hello has arrived: the client waits for a response.
  wait_for(io, peer.socket().async_wait(boost::asio::ip::tcp::socket::wait_read,
                                        boost::asio::use_awaitable));
  sut->close();
  EXPECT_TRUE(tests::run_until(io, [&] { return connected.has_value(); }));
  EXPECT_THAT(connected->error().message, HasSubstr("closed while connecting"));
}

TEST_F(SecureAdsTest, ClosesAConnectionWithoutAHandshake) {
  server_options.handshake_timeout = 50ms;
  server.emplace(io.get_executor(), device, server_options, base::program::no_log());
  auto peer = wait_for(io, RawPeer::connect(server->tcp_port()));
  EXPECT_FALSE(wait_for(io, peer.receive()));
}

TEST_F(SecureAdsTest, ServesAClientBesideAsManyHalfHandshakesAsConnections) {
  server_options.handshake_timeout = 1min;
  server_options.max_connections = 3;
  server.emplace(io.get_executor(), device, server_options, base::program::no_log());
  std::vector<RawPeer> silent;
  for (std::size_t i = 0; i < server_options.max_connections; ++i) {
    silent.push_back(wait_for(io, RawPeer::connect(server->tcp_port())));
    wait_for(io, silent.back().send({0x16, 0x03, 0x01}));
  }
  options.tcp_port = server->tcp_port();
  sut.emplace(io.get_executor(), options);
  EXPECT_TRUE(wait_for(io, sut->connect()));
  EXPECT_FALSE(wait_for(io, silent.front().receive()));
}

TEST_F(SecureAdsTest, ReleasesItsNotificationsBeforeItLeaves) {
  ASSERT_TRUE(connect());
  const AddNotificationRequest wanted{{1, 1}, 4};
  std::size_t notified = 0;
  const auto handles = wait_for(io, sut->subscribe(552, {wanted}, [&](auto&&...) { ++notified; }));
  ASSERT_TRUE(handles.at(0));
  sut->leave({.port = 552, .notifications = {*handles[0]}});
  EXPECT_TRUE(tests::run_until(io, [&] { return server->connections() == 0; }));
}

/// A self-signed certificate and its key. Made once, since RSA keys take long.
struct Holder {
  using Time = std::chrono::sys_seconds;
  static Time year(int number) { return std::chrono::sys_days(std::chrono::year(number) / 1 / 1); }
  explicit Holder(const std::string& name, Time from = year(2000), Time until = year(2001))
      : key(base::openssl::Key::generate_rsa()),
        certificate(base::openssl::self_signed(
            key, {.organisation = "millrace", .common_name = name, .from = from, .until = until})) {
  }
  base::openssl::Key key;
  base::openssl::Certificate certificate;
};

const Holder& controller() {
  static const Holder holder("controller");
  return holder;
}
const Holder& gateway() {
  static const Holder holder("gateway");
  return holder;
}

/// Both certificates have expired long ago: with fingerprints, dates do not count.
class SelfSignedAdsTest : public SecureAdsTest {
 protected:
  SelfSignedAdsTest() {
    const auto& of_controller = controller();
    const auto& of_gateway = gateway();
    server_options.security =
        ServerSecurity{.self_signed = ServerSelfSigned{of_controller.certificate.pem(),
                                                       of_controller.key.pem(), "Admin", "1"}};
    server_options.routes = std::make_shared<Routes>();
    server_options.routes->add({options.source.net_id, of_gateway.certificate.fingerprint()});
    options.security = SelfSigned{of_gateway.certificate.pem(), of_gateway.key.pem(),
                                  of_controller.certificate.fingerprint()};
  }
  SelfSigned& shown() { return std::get<SelfSigned>(*options.security); }
};

TEST_F(SelfSignedAdsTest, CarriesRequestsOfAClientWithARoute) {
  ASSERT_TRUE(connect());
  EXPECT_EQ(wait_for(io, sut->read(552, {1, 1}, 4)), (Bytes{1, 2, 3, 4}));
}

TEST_F(SelfSignedAdsTest, NeverAcceptsAnotherFingerprint) {
  const std::string expected = gateway().certificate.fingerprint();
  shown().fingerprint = expected;
  const std::string words = refusal();
  EXPECT_THAT(words, HasSubstr("its certificate has the fingerprint " +
                               controller().certificate.fingerprint()));
  EXPECT_THAT(words, HasSubstr("expected " + expected));
}

TEST_F(SelfSignedAdsTest, AcceptsNoCertificateWithoutAFingerprint) {
  shown().fingerprint.clear();
  EXPECT_THAT(refusal(), HasSubstr("its certificate has the fingerprint"));
}

TEST_F(SelfSignedAdsTest, ReportsThatItNeedsARouteWithItsFingerprint) {
  server_options.routes = std::make_shared<Routes>();
  EXPECT_THAT(refusal(),
              HasSubstr("it needs a route with its fingerprint (TlsConnectInfo error 3"));
}

TEST_F(SelfSignedAdsTest, ReportsThatKeyAndCertificateDoNotMatch) {
  shown().key = controller().key.pem();
  EXPECT_THAT(refusal(), HasSubstr("the key does not belong to the certificate"));
}

TEST_F(SelfSignedAdsTest, ReportsThatTheKeyIsNotRsa) {
  shown().key = base::openssl::Key::generate().pem();
  EXPECT_THAT(refusal(), HasSubstr("the key is not an RSA key"));
}

TEST_F(SelfSignedAdsTest, ReportsThatTheControllerSupportsOnlyPreSharedKeys) {
  server_options.security = ServerSecurity{.psk = Psk{"millrace", "secret"}};
  EXPECT_THAT(refusal(), HasSubstr("does it know pre-shared keys alone?"));
}

TEST_F(SelfSignedAdsTest, SharesItsPortWithPreSharedKeys) {
  server_options.security->psk = Psk{"millrace", "secret"};
  options.security = Psk{"millrace", "secret"};
  EXPECT_TRUE(connect());
}

TEST(AdmittedClient, WithCertificateIsKnownOnceItHasAddedARoute) {
  const ServerSecurity security{.self_signed = ServerSelfSigned{{}, {}, "Admin", "1"}};
  Routes sut;
  const NetId net_id{{10, 0, 0, 1, 1, 1}};
  ConnectInfo request{.flags = connect_flags::self_signed, .net_id = net_id};
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::unknown_certificate);
  request.flags |= connect_flags::add_route;
  request.user = "Admin";
  request.password = "2";
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::unknown_user);
  request.password = "1";
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::none);
  request = {.flags = connect_flags::self_signed, .net_id = net_id};
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::none);
  EXPECT_EQ(admit(request, {"CD"}, security, sut), ConnectError::unknown_certificate);
  request.flags = 0;
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::unknown_certificate);
}

TEST(AdmittedClient, OfASharedCaHasItsAddressOrAConfiguredNameForACommonName) {
  ServerSecurity security{.shared_ca = ServerSharedCa{}};
  security.shared_ca->clients = {"GATEWAY"};
  Routes routes;
  const ConnectInfo request{};
  EXPECT_EQ(admit(request, {"AB", "GATEWAY", "10.0.0.1"}, security, routes), ConnectError::none);
  EXPECT_EQ(admit(request, {"AB", "10.0.0.1", "10.0.0.1"}, security, routes), ConnectError::none);
  EXPECT_EQ(admit(request, {"AB", "OTHER", "10.0.0.1"}, security, routes),
            ConnectError::common_name);
  security.shared_ca->ignore_common_name = true;
  EXPECT_EQ(admit(request, {"AB", "OTHER", "10.0.0.1"}, security, routes), ConnectError::none);
}

TEST(AdmittedClient, ProvesNothingByWhatItSaysOfItself) {
  const ServerSecurity security{.shared_ca = ServerSharedCa{}};
  Routes routes;
  const TlsClient other{"AB", "OTHER", "10.0.0.1"};
  EXPECT_EQ(admit({.host = "OTHER"}, other, security, routes), ConnectError::common_name);
  EXPECT_EQ(admit({.flags = connect_flags::ignore_common_name}, other, security, routes),
            ConnectError::common_name);
}

/// The CA of a plant, and certificates that it has issued.
class SharedCaAdsTest : public SecureAdsTest {
 protected:
  SharedCaAdsTest() {
    const Issued of_controller = issue("CX-123456");
    const Issued of_gateway = issue("127.0.0.1");
    server_options.security =
        ServerSecurity{.shared_ca = ServerSharedCa{authority().certificate.pem(), of_controller.pem,
                                                   of_controller.key}};
    options.security =
        SharedCa{authority().certificate.pem(), of_gateway.pem, of_gateway.key, "cx-123456"};
  }

  struct Issued {
    std::string pem;
    std::string key;
  };
  static std::chrono::sys_seconds now() {
    return std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  }
  static const Holder& authority() {
    static const Holder holder("plant", now() - 1h, now() + 1h);
    return holder;
  }
  static Issued issue(const std::string& name, std::chrono::sys_seconds until = now() + 1h) {
    const auto& key = gateway().key;
    return {
        base::openssl::issue(
            key,
            {.organisation = "millrace", .common_name = name, .from = now() - 2h, .until = until},
            authority().certificate, authority().key)
            .pem(),
        key.pem()};
  }
  SharedCa& shown() { return std::get<SharedCa>(*options.security); }
};

TEST_F(SharedCaAdsTest, CarriesRequests) {
  ASSERT_TRUE(connect());
  EXPECT_EQ(wait_for(io, sut->read(552, {1, 1}, 4)), (Bytes{1, 2, 3, 4}));
}

TEST_F(SharedCaAdsTest, RefusesAnotherCommonName) {
  shown().common_name = "CX-1";
  EXPECT_THAT(refusal(), HasSubstr("its certificate is that of \"CX-123456\"; expected \"CX-1\""));
}

TEST_F(SharedCaAdsTest, RefusesACertificateOfAnotherCa) {
  shown().ca = controller().certificate.pem();
  EXPECT_THAT(refusal(), HasSubstr("its certificate does not lead to our CA"));
}

TEST_F(SharedCaAdsTest, RefusesACertificateThatHasExpired) {
  const Issued old = issue("CX-123456", now() - 1h);
  server_options.security->shared_ca->certificate = old.pem;
  EXPECT_THAT(refusal(), HasSubstr("has expired"));
}

TEST_F(SharedCaAdsTest, ReportsThatItsOwnCertificateHasExpired) {
  shown().certificate = issue("127.0.0.1", now() - 1h).pem;
  EXPECT_THAT(refusal(), HasSubstr("our certificate has expired"));
}

TEST_F(SharedCaAdsTest, ReportsThatItsCertificateIsOfAnotherCa) {
  shown().certificate = gateway().certificate.pem();
  EXPECT_THAT(refusal(), HasSubstr("is it signed by its CA?"));
}

TEST_F(SharedCaAdsTest, ReportsThatItsCommonNameIsNotThatOfThisHost) {
  shown().certificate = issue("elsewhere").pem;
  EXPECT_THAT(refusal(), HasSubstr("TlsConnectInfo error 2"));
}

TEST(AdmittedClient, AddsNoRouteWhereNoUserIsConfigured) {
  const ServerSecurity security{.self_signed = ServerSelfSigned{}};
  Routes sut;
  const ConnectInfo request{.flags = connect_flags::self_signed | connect_flags::add_route};
  EXPECT_EQ(admit(request, {"AB"}, security, sut), ConnectError::unknown_user);
}

}  // namespace
}  // namespace millrace::cnc::ads
