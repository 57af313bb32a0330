// Requests for the variables of one machine: what is requested from its controller and when, merged
// over all requesters, within a budget, one step at a time; which writes are allowed; and the
// replies, also those that need no request. Pure.
//
//   VariableRequests requests("press", settings);
//   requests.on_up({1, 2}, now);
//   requests.on_request(request, now);
//   if (auto step = requests.next(now)) …          // nothing more until its answer
//   requests.on_read(answers, 1, true, now);
//   publish(requests.take_output());
//   wait_until(requests.next_time(now.steady));    // then on_time() and next()
//
// A value that was read within a cycle, or is being read, answers all requests for it. Writes have
// their turn between reads, in the order of their arrival; a write is checked completely before any
// of it is written.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/recent.hpp"
#include "cnc/variables/layout.hpp"
#include "fabric/variables.hpp"
#include "gateway/data/rate_limit.hpp"
#include "gateway/data/sampler.hpp"
#include "gateway/outputs.hpp"
#include "gateway/variables/variable_cache.hpp"
#include "gateway/variables/write_rules.hpp"

namespace millrace::gateway::variables {

struct WriteOne {
  std::uint16_t channel = 0;
  std::string name;
  cnc::variables::Bytes value;
};
struct ListPage {
  std::uint16_t channel = 0;
  std::string family;
  std::uint32_t first = 0;
};
using Step = std::variant<data::Resolve, data::Read, WriteOne, ListPage>;

/// A part of the controller's list of a family.
struct Page {
  std::uint32_t total = 0;
  std::vector<cnc::variables::Description> variables;
};

/// The result of an event.
struct Output {
  struct Answer {
    fabric::InstanceId requester{};
    fabric::VariableReply reply{};
  };
  std::vector<Answer> answers;
  /// For recordings: the outcome of a variable's write, and its issuer; by the token of the
  /// request.
  struct Written {
    fabric::InstanceId token{};
    bool done = false;
    std::string detail{};
  };
  std::vector<Written> written;
  std::vector<LogLine> lines;
};

/// The replies to requests, and the records of writes.
class VariableReplies {
 public:
  /// Refused writes that are logged in a second; further ones are counted.
  static constexpr double refusals_reported = 20;

  /// Whether the request is a write that was answered; then its requester gets the reply again.
  bool repeat(const fabric::VariableRequest& request);
  void answer(const fabric::VariableRequest& request, fabric::VariableReply reply, Moment now);
  void refuse(const fabric::VariableRequest& request, const fabric::Message& reason, Moment now,
              std::vector<fabric::VariableResult> results = {});
  void report_write(const fabric::VariableRequest& request, bool done, const std::string& what,
                    Moment now);
  Output take_output() { return std::exchange(output_, {}); }

 private:
  /// Finished writes, by their tokens: a requester that missed the reply asks again.
  base::Recent<fabric::InstanceId, Output::Answer> done_writes_{256};
  data::RateLimit refusals_{refusals_reported};
  std::uint64_t unreported_refusals_ = 0;
  Output output_;
};

class VariableRequests {
 public:
  /// Limits of waiting requests, of one requester and of all, and of the names in them.
  static constexpr std::size_t most_of_one = 16;
  static constexpr std::size_t most_requests = 256;
  static constexpr std::size_t most_names = 8'192;
  /// How long a request waits for the controller: default, minimum, maximum.
  static constexpr std::chrono::seconds usual_patience{5};
  static constexpr std::chrono::milliseconds least_patience{10};
  static constexpr std::chrono::seconds most_patience{60};

  VariableRequests(std::string machine, VariableSettings settings);

  /// From now on.
  void change(const VariableSettings& settings);
  /// The controller answers, and these of its channels are served; also when there are more.
  void on_up(const std::vector<std::uint16_t>& channels, Moment now);
  /// The link is down, because of `reason`. Waiting requests get a reply.
  void on_down(const fabric::Message& reason, Moment now);
  /// The channel is not ours any more; 0 = none is. Waiting requesters ask again, and its new owner
  /// replies.
  void on_over(std::uint16_t channel, Moment now);
  void on_request(const fabric::VariableRequest& request, Moment now);
  /// Requests whose time is over get a reply.
  void on_time(Moment now);

  /// The next request; nullopt while one is pending, or none is wanted.
  std::optional<Step> next(Moment now);
  /// When next() or on_time() has something to do.
  std::optional<SteadyTime> next_time(SteadyTime now);

  /// The results of the step, in its order, and the number of its requests. `sums`: the controller
  /// reads many values in one request.
  void on_resolved(const std::vector<Found>& found, std::uint64_t requests, Moment now);
  void on_read(const std::vector<Answered>& answers, std::uint64_t requests, bool sums, Moment now);
  void on_written(const cnc::ads::Result<void>& outcome, std::uint64_t requests, Moment now);
  void on_listed(const cnc::ads::Result<Page>& page, std::uint64_t requests, Moment now);

  Output take_output() { return replies_.take_output(); }

 private:
  using Entries = std::vector<std::shared_ptr<VariableCacheEntry>>;
  enum class Phase : std::uint8_t {
    reading,
    /// The values before the write.
    before,
    writing,
    /// … and as it is then.
    after,
    listing
  };
  struct OpenRequest {
    fabric::VariableRequest request{};
    Phase phase = Phase::reading;
    /// Responses from then on count.
    SteadyTime since{};
    SteadyTime deadline{};
    Entries variables{};
    std::vector<fabric::Value> before{};
    std::vector<cnc::variables::Bytes> values{};
    std::size_t written = 0;
  };
  using OpenRequests = std::map<std::uint64_t, OpenRequest>;
  /// The pending step: of these variables, of this request, or none.
  using PendingStep = std::variant<std::monostate, Entries, std::uint64_t>;

  [[nodiscard]] std::string wrong(const fabric::VariableRequest& request) const;
  [[nodiscard]] std::string too_much(const fabric::VariableRequest& request) const;
  [[nodiscard]] std::string unwritable(const fabric::VariableRequest& request, Moment now) const;
  void add(const fabric::VariableRequest& request, Moment now);

  struct Batch;
  std::optional<Step> turn_of(std::uint64_t number, const OpenRequest& open);
  void add_to_batch(Batch& batch, const OpenRequest& open);
  std::optional<Step> start(Batch batch);

  /// Completes all requests that can be answered now.
  void complete(Moment now);
  /// True if the request was answered.
  bool complete(OpenRequest& open, Moment now);
  [[nodiscard]] std::string prepare(OpenRequest& open) const;
  void finish_read(const OpenRequest& open, Moment now);
  /// The step is over, after so many requests to the controller. Returns its variables.
  Entries end_step(std::uint64_t requests = 0);
  /// … and returns its request, if that is still open.
  OpenRequests::iterator end_request_step(std::uint64_t requests);
  [[nodiscard]] bool pending() const { return pending_.index() != 0; }
  void expire(OpenRequest& open, Moment now);

  /// What an interrupted write has done; empty if nothing is written. `under_way`: the controller
  /// has the request to write.
  [[nodiscard]] static std::string progress_of(const OpenRequest& open, bool under_way);
  [[nodiscard]] static std::vector<fabric::VariableResult> results_of(const OpenRequest& open);

  std::string machine_;
  VariableSettings settings_;
  data::RateLimit rate_limit_;
  VariableCache cache_;
  std::size_t at_once_ = data::Sampler::most_together;
  /// Nothing while the link is up.
  std::optional<std::string> down_reason_ = "the controller has not answered yet";
  /// Since when each channel is served, also while the link is down.
  std::map<std::uint16_t, SteadyTime> served_;
  OpenRequests requests_;
  std::uint64_t last_number_ = 0;
  PendingStep pending_;
  bool resolved_last_ = false;
  VariableReplies replies_;
};

}  // namespace millrace::gateway::variables
