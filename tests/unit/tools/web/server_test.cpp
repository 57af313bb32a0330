#include "tools/web/live/server.hpp"

#include <future>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/await.hpp"
#include "tests/support/http_client.hpp"
#include "tools/web/live/messages.hpp"

namespace millrace::tools::web::live {
namespace {

using namespace std::chrono_literals;
using tests::HttpClient;
using tests::HttpEvents;

/// In its own thread, as browsers see it.
class AServer : public testing::Test {
 protected:
  void start(ServerOptions options) {
    options.port = 0;
    sut = std::make_unique<Server>(io.get_executor(), options, site, base::program::no_log());
    sut->on_greeting([] { return event_text("snapshot", "{}"); });
    port = sut->port();
    loop = std::thread([this] { io.run(); });
  }
  void TearDown() override {
    if (loop.joinable()) {
      io.stop();
      loop.join();
    }
    sut.reset();
  }
  template <typename Work>
  auto on_loop(Work work) {
    std::packaged_task<decltype(work())()> task(work);
    auto result = task.get_future();
    boost::asio::post(io, [&task] { task(); });
    return result.get();
  }
  ServerCounts counts() {
    return on_loop([this] { return sut->counts(); });
  }

  boost::asio::io_context io{1};
  const boost::asio::executor_work_guard<boost::asio::io_context::executor_type> stay{
      io.get_executor()};
  plant::PlantModel plant{{}};
  http::Pages pages;
  std::promise<void> examined;
  http::Site site{{.plant = plant, .pages = pages, .doctor = [this] {
                     return [this] {
                       examined.get_future().wait();
                       return boost::json::object{};
                     };
                   }}};
  std::unique_ptr<Server> sut;
  std::thread loop;
  std::uint16_t port = 0;
};

TEST_F(AServer, DropsABrowserThatDoesNotReadWithoutDisturbingOthers) {
  start({.time_to_read = 300ms});
  HttpClient deaf(port);
  deaf.send("GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n");
  HttpEvents reader(port, "/api/live");
  EXPECT_EQ(reader.next().name, "snapshot");
  tests::await("both", [&] { return counts().browsers == 2; });
  const std::string much(1U << 20U, 'x');
  for (int i = 0; i < 30; ++i) {
    on_loop([&] {
      sut->publish("changes", much);
      return true;
    });
    EXPECT_EQ(reader.next().data.size(), much.size());
  }
  tests::await("the slow client to be dropped", [&] { return counts().browsers == 1; });
  EXPECT_EQ(counts().connections, 1U);
}

TEST_F(AServer, EndsAConnectionWhoseRequestIsTooSlow) {
  start({.time_to_ask = 200ms});
  HttpClient slow(port);
  slow.send("GET / HTT");
  EXPECT_TRUE(slow.is_ended());
  HttpClient silent(port);
  EXPECT_TRUE(silent.is_ended());
  EXPECT_EQ(HttpClient(port).get("/healthz").status, 200);
}

TEST_F(AServer, DropsAnIdleConnectionForANewOne) {
  start({.most_connections = 2});
  HttpClient first(port);
  EXPECT_EQ(first.get("/healthz").status, 200);
  HttpEvents stays(port, "/api/live");
  stays.next();
  HttpClient third(port);
  EXPECT_EQ(third.get("/healthz").status, 200);
  EXPECT_TRUE(first.is_ended());
  EXPECT_EQ(counts().displaced, 1U);
}

TEST_F(AServer, DropsOfTheAddressWithMostIdleConnectionsTheOneThatHasWaitedLongest) {
  start({.most_connections = 5});
  HttpClient other(port, tests::patience, 2);
  EXPECT_EQ(other.get("/healthz").status, 200);
  HttpClient active(port);
  HttpClient half(port);
  half.send("GET / HTT");
  HttpClient silent(port);
  // A loaded server may accept a connection after it has answered a younger one.
  tests::await("all four", [&] { return counts().connections == 4; });
  EXPECT_EQ(active.get("/healthz").status, 200);
  HttpClient fifth(port, tests::patience, 3);
  EXPECT_EQ(fifth.get("/healthz").status, 200);
  HttpClient sixth(port, tests::patience, 3);
  EXPECT_EQ(sixth.get("/healthz").status, 200);
  HttpClient seventh(port, tests::patience, 3);
  EXPECT_EQ(seventh.get("/healthz").status, 200);
  EXPECT_TRUE(half.is_ended());
  EXPECT_TRUE(silent.is_ended());
  EXPECT_EQ(other.get("/healthz").status, 200);
  EXPECT_EQ(active.get("/healthz").status, 200);
  EXPECT_EQ(counts().displaced, 2U);
}

TEST_F(AServer, AnswersOthersWhileSomethingTakesLong) {
  start({});
  HttpClient patient(port);
  patient.send("GET /api/doctor HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(HttpClient(port).get("/healthz").status, 200);
  examined.set_value();
  EXPECT_EQ(patient.receive().status, 200);
}

TEST_F(AServer, AnswersSeveralRequestsOfOneConnection) {
  start({});
  HttpClient sut_client(port);
  EXPECT_EQ(sut_client.get("/healthz").status, 200);
  EXPECT_EQ(sut_client.get("/none").status, 404);
  sut_client.send(
      "HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\nGET /healthz HTTP/1.1\r\nHost: "
      "localhost\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(sut_client.receive_some(), testing::HasSubstr("Content-Length: "));
  tests::await("the end", [&] { return sut_client.is_ended(); });
  EXPECT_EQ(counts().requests, 4U);
}

TEST_F(AServer, RefusesARequestWithTwoHosts) {
  start({});
  HttpClient client(port);
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(client.receive().status, 403);
}

// A regression: the body of such a request was read as the next request.
TEST_F(AServer, RefusesARequestOfUnknownLengthAndEndsItsConnection) {
  start({});
  for (const std::string coding : {"xchunked", "chunked, identity", "gzip"}) {
    HttpClient client(port);
    client.send("POST /api/login HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: " + coding +
                "\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_THAT(client.receive().status, testing::AnyOf(400, 501)) << coding;
    tests::await("the end", [&] { return client.is_ended(); });
  }
}

Message forwarded(const std::vector<std::string>& lines) {
  Message message;
  for (const std::string& line : lines) {
    message.insert("X-Forwarded-For", line);
  }
  return message;
}

TEST(TheClientOfARequest, IsThePeerUnlessThatIsATrustedProxy) {
  const Message message = forwarded({"10.0.0.9, 10.0.0.7", "10.0.0.5"});
  EXPECT_EQ(client_of(message, "10.0.0.1", {}), "10.0.0.1");
  EXPECT_EQ(client_of(message, "10.0.0.1", {"127.0.0.1"}), "10.0.0.1");
  EXPECT_EQ(client_of(message, "127.0.0.1", {"127.0.0.1"}), "10.0.0.5");
  EXPECT_EQ(client_of(message, "127.0.0.1", {"127.0.0.1", "10.0.0.5"}), "10.0.0.7");
}

TEST(TheClientOfARequest, IsTheProxyIfThatNamesNoAddress) {
  for (const std::string forwarded_for : {"", "unknown", "10.0.0.5, ?", "1.2.3.4:80", "<script>"}) {
    EXPECT_EQ(client_of(forwarded({forwarded_for}), "127.0.0.1", {"127.0.0.1"}), "127.0.0.1")
        << forwarded_for;
  }
}

TEST_F(AServer, ReportsWhyItCannotListen) {
  start({});
  try {
    const Server second(io.get_executor(), {.port = port}, site, base::program::no_log());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--listen chooses another"));
  }
}

}  // namespace
}  // namespace millrace::tools::web::live
