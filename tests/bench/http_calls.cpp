// The time of a call through millrace-http, compared with that of a bare POST to the same server.
//
//   http_calls [CALLS]
//
// A square root over DDS, a POST by libcurl on one connection, and a call through millrace-http are
// made in turn, in a network of the benchmark's own. Prints medians and 99th percentiles in
// microseconds, and the processor time of millrace-http with 100 URLs and no calls; exit code 1 if
// a goal is missed.
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <curl/curl.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/bench/process_use.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/own_network.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace millrace;
using bench::Clock;

/// Through millrace-http, of a call over DDS and a POST together.
constexpr double goal = 1.5;
constexpr double idle_goal = 0.01;
constexpr int idle_urls = 100;

const std::string dds_uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string http_uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341";
const std::string answer = R"({"text":"1.414214","state":1})";

/// Answers every request with the same.
class Server {
 public:
  Server() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), size);
    ::listen(listener_, SOMAXCONN);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    std::thread([listener = listener_] {
      for (int socket = 0; (socket = ::accept(listener, nullptr, nullptr)) >= 0;) {
        std::thread(serve, socket).detach();
      }
    }).detach();
  }
  [[nodiscard]] std::string url() const { return fmt::format("http://127.0.0.1:{}/", port_); }

 private:
  static void serve(int socket) {
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const std::string response = fmt::format(
        "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{}",
        answer.size(), answer);
    std::string got;
    char bytes[4096];
    for (ssize_t count = 0; (count = ::recv(socket, bytes, sizeof bytes, 0)) > 0;) {
      got.append(bytes, static_cast<std::size_t>(count));
      const std::size_t head = got.find("\r\n\r\n");
      const std::size_t field = got.find("Content-Length: ");
      if (head == std::string::npos || field == std::string::npos ||
          got.size() < head + 4 + std::stoul(got.substr(field + 16))) {
        continue;
      }
      got.clear();
      ::send(socket, response.data(), response.size(), MSG_NOSIGNAL);
    }
    ::close(socket);
  }

  int listener_;
  int port_ = 0;
};

std::size_t append(char* data, std::size_t size, std::size_t count, void* to) {
  static_cast<std::string*>(to)->append(data, size * count);
  return size * count;
}

/// POSTs on one connection.
class Curl {
 public:
  explicit Curl(const std::string& url) : handle_(curl_easy_init()) {
    curl_easy_setopt(handle_, CURLOPT_URL, url.c_str());
    headers_ = curl_slist_append(nullptr, "Content-Type: application/json");
    curl_easy_setopt(handle_, CURLOPT_HTTPHEADER, headers_);
    curl_easy_setopt(handle_, CURLOPT_WRITEFUNCTION, &append);
    curl_easy_setopt(handle_, CURLOPT_WRITEDATA, &got_);
    curl_easy_setopt(handle_, CURLOPT_POSTFIELDS,
                     R"({"uuid":"1b671a64-40d5-491e-99b0-da01ff1f3341","text":"2","state":1})");
  }
  ~Curl() {
    curl_slist_free_all(headers_);
    curl_easy_cleanup(handle_);
  }
  Curl(const Curl&) = delete;
  Curl& operator=(const Curl&) = delete;

  void post() {
    got_.clear();
    if (curl_easy_perform(handle_) != CURLE_OK || got_ != answer) {
      throw std::runtime_error("the server does not answer");
    }
  }

 private:
  CURL* handle_;
  curl_slist* headers_ = nullptr;
  std::string got_;
};

void call(tests::Caller& caller, const std::string& uuid, bench::Series& times) {
  const fabric::Request request = caller.request(uuid, "2");
  const auto start = Clock::now();
  caller.publish(request);
  const fabric::Reply reply = caller.await_reply(request);
  times.add(Clock::now() - start);
  caller.withdraw(request);
  if (reply.text != "1.414214") {
    throw std::runtime_error(fmt::format("{} answered {:?}", uuid, reply.text));
  }
}

double print(const char* what, bench::Series& times) {
  fmt::print("{}: median {:.1f} us, 99 % {:.1f} us\n", what, times.median(), times.p99());
  return times.median();
}

tests::Process start(const tests::TemporaryFolder& folder, const std::string& domain) {
  tests::Process http({tests::binary("millrace-http"), "--config",
                       (folder.path() / "http.textproto").string(), "--domain", domain,
                       "--log-level", "warn"});
  http.await("^ready: ");
  return http;
}

bool measure_calls(std::size_t calls) {
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  const tests::TemporaryFolder folder;
  const Server server;
  std::ofstream(folder.path() / "http.textproto")
      << "service { uuid: '" << http_uuid << "' url: '" << server.url() << "' }";
  const tests::Process direct(
      {tests::binary("millrace-square-root"), "--domain", number, "--log-level", "warn"});
  const tests::Process http = start(folder, number);
  tests::Caller caller(domain.number());
  if (!caller.await_instance(dds_uuid) || !caller.await_instance(http_uuid)) {
    throw std::runtime_error("the services were not found");
  }
  Curl curl(server.url());
  bench::Series over_dds;
  bench::Series over_curl;
  bench::Series through;
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    if (i == calls / 10) {
      // The calls so far were the warm-up.
      over_dds = over_curl = through = {};
    }
    call(caller, dds_uuid, over_dds);
    const auto start = Clock::now();
    curl.post();
    over_curl.add(Clock::now() - start);
    call(caller, http_uuid, through);
  }
  const double dds = print("square root over DDS", over_dds);
  const double bare = print("bare POST", over_curl);
  const double both = print("through millrace-http", through);
  const double ratio = both / (dds + bare);
  fmt::print("{:.2f} times a bare POST; {:.2f} times a call over DDS and a POST, {}\n", both / bare,
             ratio, bench::verdict(ratio, goal, true));
  return ratio <= goal;
}

bool measure_idle() {
  const tests::Domain domain;
  const tests::TemporaryFolder folder;
  const Server server;
  {
    std::ofstream config(folder.path() / "http.textproto");
    for (int i = 0; i < idle_urls; ++i) {
      config << fmt::format("service {{ uuid: '{:08}' url: '{}{}' }}\n", i, server.url(), i);
    }
  }
  const tests::Process http = start(folder, std::to_string(domain.number()));
  tests::Caller caller(domain.number());
  if (!caller.await_instance(fmt::format("{:08}", idle_urls - 1))) {
    throw std::runtime_error("the services were not found");
  }
  constexpr std::chrono::seconds span{20};
  const double before = bench::processor_seconds(http.pid());
  std::this_thread::sleep_for(span);
  const double share =
      (bench::processor_seconds(http.pid()) - before) / static_cast<double>(span.count());
  fmt::print("{} URLs without calls: {:.2f} % of a core, {}\n", idle_urls, 100 * share,
             bench::verdict(100 * share, 100 * idle_goal, true));
  return share <= idle_goal;
}

}  // namespace

int main(int argc, char** argv) {
  if (const std::string obstacle = tests::enter_own_network(); !obstacle.empty()) {
    fmt::print(stderr, "http_calls: {}\n", obstacle);
    return EXIT_FAILURE;
  }
  constexpr std::size_t usual = 5'000;
  try {
    const bool fast = measure_calls(argc > 1 ? std::stoul(argv[1]) : usual);
    return measure_idle() && fast ? EXIT_SUCCESS : EXIT_FAILURE;
  } catch (const std::exception& error) {
    fmt::print(stderr, "http_calls: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
