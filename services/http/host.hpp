// The URLs of a configuration as instances on the fabric.
//
// All decisions are made in one thread, that of run(); events of DDS arrive by an inbox. An
// instance is announced only while its endpoint is reachable. A call that must not run twice and
// whose connection was lost stays unanswered: the instance drains, and leaves when its other calls
// have ended, so that the gateway blocks that call for an operator.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "services/http/config.hpp"
#include "services/http/transfers.hpp"
#include "services/sdk/alarms.hpp"
#include "services/sdk/file_changes.hpp"
#include "services/sdk/instance.hpp"

namespace millrace::services::http {

class Host {
 public:
  /// Serves the endpoints, which have their secrets, and those of later versions of `file`. `base`:
  /// the participant of all instances, and their version. `name`: of this process in its alarms.
  Host(const std::filesystem::path& file, const std::vector<Endpoint>& endpoints,
       sdk::ServiceOptions base, const std::string& name, sdk::Service::Log log);

  /// Returns after stop(), or when operators have drained all instances, once no call runs.
  void run();
  /// From any thread.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;
  using Time = Clock::time_point;
  using CallPointer = std::shared_ptr<const sdk::Call>;
  using EndpointPointer = std::shared_ptr<const Endpoint>;
  /// Of an instance.
  using Number = std::uint64_t;

  struct RunningCall {
    CallPointer call;
    /// Its time limit.
    Time end{};
    std::optional<Transfers::Id> transfer{};
    /// The URL of its result after 202.
    std::string result_url{};
    /// When it is sent, or its result is looked at next; nothing during a transfer.
    std::optional<Time> next{};
    /// It may have run, and there will be no response.
    bool lost = false;
  };
  /// An instance on the fabric.
  struct Announced {
    EndpointPointer endpoint;
    // In this order: releasing a call answers it, which has no effect once the instance is gone.
    std::map<fabric::CallId, RunningCall> calls{};
    std::unique_ptr<sdk::Instance> instance{};
    /// The endpoint has no room until then. A call is declined once, for another instance to get
    /// it; when it comes back, it waits here.
    Time full_until{};
    std::set<fabric::CallId> declined{};
    /// It drains, and stays at least until then.
    std::optional<Time> leaves_at{};
  };
  /// An endpoint of the configuration.
  struct Served {
    EndpointPointer endpoint;
    std::optional<Number> announced{};
    std::optional<Transfers::Id> check{};
    Time next_check{};
    /// Why it is not announced, or has proved nothing since; empty before the first check.
    std::string trouble{};
    /// Calls in a row that have not begun, although its checks succeed, as at a proxy that answers
    /// and forwards nothing.
    unsigned not_begun = 0;
    /// After such calls: it has recovered, unless a call fails until then.
    Time recovered_at = Time::max();
    /// An operator has drained its instance.
    bool dismissed = false;
  };
  struct Cancelled {
    fabric::CallId call{};
  };
  struct Dismissed {};
  struct Message {
    Number to = 0;
    std::variant<CallPointer, Cancelled, Dismissed> content;
  };

  void serve(const std::vector<Endpoint>& endpoints);
  void reload_if_changed(Time now);

  void check(Served& served, Time now);
  void checked(Served& served, const Exchange& exchange);
  void announce(Served& served);
  void take_down(Served& served, const std::string& reason);
  void recover(Served& served);
  void drain(Served& served);
  [[nodiscard]] Served* served_of(Number number);

  void put(Number to, std::variant<CallPointer, Cancelled, Dismissed> content);
  void read_inbox();
  void begin(Number number, const CallPointer& call);
  void post(Number number, RunningCall& running, Time now);
  void ended(Number number, fabric::CallId id, const Exchange& exchange);
  void end(Announced& at, fabric::CallId id, const sdk::Response& response);
  void look_at_result(Number number, RunningCall& running, Time now);
  void lose(Number number, fabric::CallId id, const std::string& reason);
  [[nodiscard]] RunningCall* find(Number number, fabric::CallId id);

  void on_time(Time now);
  [[nodiscard]] std::chrono::milliseconds until_next(Time now) const;
  [[nodiscard]] bool done() const;

  const std::filesystem::path file_;
  const sdk::ServiceOptions base_;
  const sdk::Service::Log log_;
  std::mutex lock_;
  // With the lock:
  std::vector<Message> inbox_;
  bool stop_ = false;
  // In the thread of run():
  sdk::Alarms alarms_;
  std::vector<std::filesystem::path> files_;
  sdk::Settle settle_;
  Time next_look_{};
  bool stopping_ = false;
  Number last_number_ = 0;
  std::list<Served> served_;
  /// Before the instances, whose events wake it until they are gone.
  Transfers transfers_;
  std::map<Number, Announced> announced_;
};

}  // namespace millrace::services::http
