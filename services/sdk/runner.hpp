// Executes the call scheduler's decisions: calls to an inline handler or into a work queue, replies
// to the fabric, at debug a log line for each; failures are warnings.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/messages.hpp"
#include "services/sdk/call_scheduler.hpp"
#include "services/sdk/response.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

// The receiver of a call's reports.

/// Implemented by the instance that runs the call; its functions may be called from any thread.
class CallSink {
 public:
  virtual ~CallSink() = default;
  /// The response has passed check_text.
  virtual void interim(fabric::CallId call, const Response& response) = 0;
  virtual void finished(fabric::CallId call, const Result& result) = 0;
  /// The handler has not begun it and will not.
  virtual void declined(fabric::CallId call, const std::string& reason) = 0;
};

/// Runs calls where their requests are received (Receiving::directly), which saves a hand-over. The
/// process receives nothing from the fabric in that time: after one call over the limit, calls get
/// threads of their own.
struct InlineHandler {
  /// Null if all calls wait for Runner::next.
  AsyncHandler handler;
  std::chrono::steady_clock::duration limit = inline_limit;
  /// It only passes calls on: it may be called in any thread that begins a call, and stays inline.
  bool forwards = false;
  /// Called for each call that is cancelled after it was passed on; may be empty. Like the handler,
  /// it must not block.
  std::function<void(fabric::CallId)> cancelled{};
};

/// All functions may be called from any thread, requests in the one that receives them: nothing
/// here waits but `next`. A lock keeps the order of decisions and replies.
class Runner : public CallSink,
               public fabric::endpoints::ReplyEndpointListener,
               public std::enable_shared_from_this<Runner> {
 public:
  /// `requested` is called for each request; may be empty.
  Runner(CallSchedulerOptions options, Service::Log log, InlineHandler inline_handler,
         std::function<void()> requested = nullptr);

  /// Publishes replies from now on; null to stop. Calls that came before are passed on now.
  void set_endpoint(fabric::endpoints::ReplyPublisher* endpoint);

  void on_request(const fabric::Request& request) override;
  void on_withdrawn(const fabric::RequestKey& key) override;
  void on_orphaned(const fabric::RequestKey& key) override;
  void on_ignored(const std::string& reason) override;
  void interim(fabric::CallId call, const Response& response) override;
  void finished(fabric::CallId call, const Result& result) override;
  void declined(fabric::CallId call, const std::string& reason) override;

  /// Waits for a call until `end`; null if none came, or no more will come.
  std::shared_ptr<const Call> next(std::chrono::steady_clock::time_point end);

  /// Accepts no more calls once the running ones are answered.
  void close_when_idle();
  /// Accepts no more calls from now on.
  void close();

  [[nodiscard]] bool closed() const;

  /// The number of calls that it stores for notifications of cancellation.
  [[nodiscard]] std::size_t remembered() const;
  [[nodiscard]] fabric::InstanceLoad load() const;

 private:
  using Lock = std::unique_lock<std::mutex>;
  enum class Place { workers, here };

  /// Ends the lock: log lines are written and handlers are called without it.
  void perform(Lock lock, const Actions& actions, Place place = Place::workers);
  void wake_workers(const Actions& actions, bool all);
  void run_here(const std::shared_ptr<const Call>& call);
  void report_cancelled(const Actions& actions) const;
  void announce(const Call& call) const;
  void perform(const Start& start);
  /// A failure to send an answer goes to `trouble`, for the log.
  void perform(const Send& send, std::vector<std::string>& trouble);
  /// A copy of the stop sources that are requested to stop without the lock: their callbacks may
  /// answer.
  void perform(const Cancel& cancel, std::vector<std::stop_source>& cancelled);
  void log(const Action& action) const;

  Service::Log log_;
  mutable std::mutex lock_;
  std::condition_variable changed_;
  CallScheduler scheduler_;
  fabric::endpoints::ReplyPublisher* endpoint_ = nullptr;
  std::deque<std::shared_ptr<const Call>> work_;
  /// Notifies calls that run or wait for a thread of their cancellation. It does not hold the calls
  /// themselves: to drop the last reference ends a call, and that takes the lock.
  std::map<fabric::CallId, std::stop_source> cancelled_;
  const InlineHandler inline_handler_;
  const std::function<void()> requested_;
  /// Calls run where their requests are received. Used only there, by one thread at a time.
  bool fast_enough_ = inline_handler_.handler != nullptr;
  bool closing_ = false;
  bool closed_ = false;
};

}  // namespace millrace::services::sdk
