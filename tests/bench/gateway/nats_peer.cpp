// NATS on loopback, for comparison: a requester, a nats-server, and peers in a queue group, each
// with its own subscription.
#include <atomic>
#include <memory>
#include <semaphore>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <nats/nats.h>

#include "tests/bench/gateway/fleet.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/process_use.hpp"

namespace millrace::bench {

namespace {

constexpr const char* subject = "bench.request";
constexpr const char* group = "peers";
constexpr const char* inbox = "bench.reply";

void check(natsStatus status, const char* what) {
  if (status != NATS_OK) {
    throw std::runtime_error(fmt::format("NATS: cannot {}: {}", what, natsStatus_GetText(status)));
  }
}

struct Closer {
  void operator()(natsConnection* connection) const { natsConnection_Destroy(connection); }
  void operator()(natsSubscription* subscription) const { natsSubscription_Destroy(subscription); }
};
using Connection = std::unique_ptr<natsConnection, Closer>;
using Subscription = std::unique_ptr<natsSubscription, Closer>;

/// Sends each message at once, as a call that a program waits for must be.
Connection connect(std::uint16_t port) {
  natsOptions* options = nullptr;
  check(natsOptions_Create(&options), "make options");
  natsOptions_SetURL(options, fmt::format("nats://127.0.0.1:{}", port).c_str());
  natsOptions_SetSendAsap(options, true);
  natsConnection* connection = nullptr;
  const natsStatus status = natsConnection_Connect(&connection, options);
  natsOptions_Destroy(options);
  check(status, "connect");
  return Connection(connection);
}

void echo(natsConnection* connection, natsSubscription*, natsMsg* message, void*) {
  natsConnection_Publish(connection, natsMsg_GetReply(message), natsMsg_GetData(message),
                         natsMsg_GetDataLength(message));
  natsMsg_Destroy(message);
}

/// A server on a free port of the loopback.
class Server {
 public:
  Server() {
    const std::string port =
        process_.await_error("Listening for client connections on 127\\.0\\.0\\.1:(\\d+)").at(1);
    port_ = static_cast<std::uint16_t>(std::stoul(port));
    process_.await_error("Server is ready");
  }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] double processor_seconds() const {
    return bench::processor_seconds(process_.pid());
  }

 private:
  tests::Process process_{{"/usr/sbin/nats-server", "--addr", "127.0.0.1", "--port", "-1"}};
  std::uint16_t port_ = 0;
};

/// Makes calls, many at a time; the reply to one leads to the next.
class Requester {
 public:
  Requester(std::uint16_t port, const NatsLoad& load)
      : connection_(connect(port)), text_(load.size, 'x'), started_(load.in_flight) {
    for (std::size_t key = 0; key < load.in_flight; ++key) {
      replies_.push_back(fmt::format("{}.{}", inbox, key));
    }
    natsSubscription* made = nullptr;
    check(natsConnection_Subscribe(&made, connection_.get(), fmt::format("{}.*", inbox).c_str(),
                                   &Requester::on_reply, this),
          "subscribe");
    subscription_.reset(made);
    check(natsConnection_Flush(connection_.get()), "subscribe");
  }

  /// Nothing if it takes longer than `limit`; then the requester is unusable.
  std::optional<RawResult> run(std::size_t calls, std::chrono::milliseconds limit) {
    result_ = {};
    to_finish_ = calls;
    to_start_ = static_cast<std::int64_t>(calls);
    const double before = own_processor_microseconds();
    const auto start = Clock::now();
    for (std::size_t key = 0; key < replies_.size() && ask(key); ++key) {
    }
    if (!done_.try_acquire_for(limit)) {
      return std::nullopt;
    }
    const std::chrono::duration<double> took = ended_ - start;
    result_.microseconds_per_call =
        (own_processor_microseconds() - before) / static_cast<double>(calls);
    result_.calls_per_second = static_cast<double>(calls) / took.count();
    return std::move(result_);
  }

 private:
  static void on_reply(natsConnection*, natsSubscription*, natsMsg* message, void* self) {
    const std::string to = natsMsg_GetSubject(message);
    natsMsg_Destroy(message);
    static_cast<Requester*>(self)->take(std::stoul(to.substr(to.rfind('.') + 1)));
  }

  void take(std::size_t key) {
    result_.round_trips.add(Clock::now() - started_[key]);
    if (--to_finish_ == 0) {
      ended_ = Clock::now();
      done_.release();
    } else {
      ask(key);
    }
  }

  /// False when all wanted calls have been made.
  bool ask(std::size_t key) {
    if (to_start_.fetch_sub(1) <= 0) {
      return false;
    }
    started_[key] = Clock::now();
    return natsConnection_PublishRequest(connection_.get(), subject, replies_[key].c_str(),
                                         text_.data(), static_cast<int>(text_.size())) == NATS_OK;
  }

  Connection connection_;
  std::string text_;
  // By key.
  std::vector<std::string> replies_;
  std::vector<Clock::time_point> started_;
  RawResult result_;
  std::atomic<std::int64_t> to_start_ = 0;
  std::size_t to_finish_ = 0;
  Clock::time_point ended_;
  std::binary_semaphore done_{0};
  Subscription subscription_;
};

}  // namespace

void serve_nats(const PeerOptions& options) {
  const Connection connection = connect(options.port);
  std::vector<Subscription> subscriptions;
  for (std::uint32_t i = 0; i < options.count; ++i) {
    natsSubscription* subscription = nullptr;
    check(natsConnection_QueueSubscribe(&subscription, connection.get(), subject, group, &echo,
                                        nullptr),
          "subscribe");
    subscriptions.emplace_back(subscription);
  }
  check(natsConnection_Flush(connection.get()), "subscribe");
  peer_is_ready();
  wait_for_ever();
}

std::optional<NatsResult> measure_nats(const NatsLoad& load) {
  constexpr std::chrono::seconds patience{60};
  const Server server;
  Fleet peers({.kind = "nats", .port = server.port()}, load.instances, load.processes);
  if (!peers.await_ready(patience)) {
    return std::nullopt;
  }
  Requester requester(server.port(), load);
  if (!requester.run(load.calls / 10 + 1, patience)) {
    return std::nullopt;
  }
  const double of_server = server.processor_seconds();
  const double of_peers = peers.processor_seconds();
  auto result = requester.run(load.calls, patience);
  if (!result) {
    return std::nullopt;
  }
  const double calls = static_cast<double>(load.calls) / 1e6;
  return NatsResult{std::move(*result), (server.processor_seconds() - of_server) / calls,
                    (peers.processor_seconds() - of_peers) / calls};
}

}  // namespace millrace::bench
