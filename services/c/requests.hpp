// The calls that a process makes: the state of each millrace_request.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include <boost/asio/steady_timer.hpp>

#include "services/c/errors.hpp"
#include "services/sdk/shared_participant.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/caller.hpp"

namespace millrace::services::c {

/// The responses to one request, from the loop to the thread that waits.
class Progress {
 public:
  struct Result {
    millrace_code code = MILLRACE_NOTHING;
    fabric::Reply reply{};
    /// Empty if there is a reply.
    std::string reason{};
    std::chrono::nanoseconds took{};
  };

  void add_interim(const fabric::Reply& reply);
  void end(Result result);
  /// The oldest interim response; after the last one the final response, at each further wait too.
  Result wait(std::optional<std::chrono::milliseconds> limit);
  [[nodiscard]] bool has_ended() const;

 private:
  mutable std::mutex lock_;
  std::condition_variable news_;
  std::deque<fabric::Reply> interim_;
  std::optional<Result> final_;
};

/// Construct, use and destroy it on the loop of the member.
class Requests final : private tools::caller::CallerListener {
 public:
  explicit Requests(sdk::SharedParticipant& shared);
  ~Requests() override;

  /// Sets the key of `order`. Throws Error for a request that no NC program could make.
  fabric::CallId send(tools::caller::Order order, const std::shared_ptr<Progress>& progress);
  void cancel(const fabric::CallId& call);

 private:
  struct Pending {
    std::shared_ptr<Progress> progress;
    tools::caller::Order order;
    tools::bus::ListeningTime time;
    std::unique_ptr<boost::asio::steady_timer> timer;
    bool unserved = false;
  };

  void on_ended(const tools::caller::Ended& ended) override;
  void on_interim(const fabric::Reply& reply) override;
  void wait_for_an_instance(const fabric::CallId& call);
  [[nodiscard]] std::uint16_t free_channel() const;

  sdk::SharedParticipant& shared_;
  const tools::caller::Slot slot_;
  std::set<std::uint16_t> used_;
  std::map<fabric::CallId, Pending> pending_;
  // Last: its destructor ends its calls.
  tools::caller::Caller caller_;
};

}  // namespace millrace::services::c
