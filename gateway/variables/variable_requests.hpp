// Questions about the variables of one machine: what is asked of its controller and when, merged
// over all who ask, within a budget, one step at a time; what may be written; and what is answered,
// also when there is nothing to ask. Pure.
//
//   VariableRequests requests("press", settings);
//   requests.on_up({1, 2}, now);
//   requests.on_request(request, now);
//   if (auto step = requests.next(now)) …          // nothing more until its answer
//   requests.on_read(answers, 1, true, now);
//   publish(requests.take_output());
//   wait_until(requests.next_time(now.steady));    // then on_time() and next()
//
// A value that was read within a cycle, or is being read, answers everybody who asks for it. Writes
// have their turn between reads, in the order in which they came; all of a write is checked before
// any of it is written.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "cnc/variables/layout.hpp"
#include "fabric/variables.hpp"
#include "gateway/data/rate_limit.hpp"
#include "gateway/data/sampler.hpp"
#include "gateway/readers.hpp"
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

/// What the controller has of a family.
struct Page {
  std::uint32_t total = 0;
  std::vector<cnc::variables::Description> variables;
};

/// What comes of an event.
struct Output {
  struct Answer {
    fabric::InstanceId requester{};
    fabric::VariableReply reply{};
  };
  std::vector<Answer> answers;
  /// For recordings: what became of a variable that was to be written, and by whom; by the token of
  /// the request.
  struct Written {
    fabric::InstanceId token{};
    bool done = false;
    std::string detail{};
  };
  std::vector<Written> written;
  struct Line {
    Level level = Level::info;
    std::string text{};
  };
  std::vector<Line> lines;
};

class VariableRequests {
 public:
  /// Requests that wait at once, of one who asks and of all, and names in all of them.
  static constexpr std::size_t most_of_one = 16;
  static constexpr std::size_t most_requests = 256;
  static constexpr std::size_t most_names = 8'192;
  /// How long is waited for the controller, whoever asks: unless said, at least, at most.
  static constexpr std::chrono::seconds usual_patience{5};
  static constexpr std::chrono::milliseconds least_patience{10};
  static constexpr std::chrono::seconds most_patience{60};
  /// Refused writes that are told of in a second; what is more is counted.
  static constexpr double refusals_reported = 20;

  VariableRequests(std::string machine, VariableSettings settings);

  /// From now on.
  void change(const VariableSettings& settings);
  /// The controller answers, and these of its channels are served; also when there are more.
  void on_up(const std::vector<std::uint16_t>& channels, Moment now);
  /// It does not: `reason` says why. Who waits is told.
  void on_down(const std::string& reason, Moment now);
  /// The channel is not ours any more; 0 = none is. Who waits asks again, and somebody else
  /// answers.
  void on_over(std::uint16_t channel, Moment now);
  void on_request(const fabric::VariableRequest& request, Moment now);
  /// Who has waited long enough is told.
  void on_time(Moment now);

  /// What to ask now; nothing while something is under way, or nothing is wanted.
  std::optional<Step> next(Moment now);
  /// When next() or on_time() has something to do.
  std::optional<SteadyTime> next_time(SteadyTime now);

  /// What came of the step, in its order, and how many requests that took. `sums`: the controller
  /// reads many values in one request.
  void on_resolved(const std::vector<Found>& found, std::uint64_t requests, Moment now);
  void on_read(const std::vector<Answered>& answers, std::uint64_t requests, bool sums, Moment now);
  void on_written(const cnc::ads::Result<void>& outcome, std::uint64_t requests, Moment now);
  void on_listed(const cnc::ads::Result<Page>& page, std::uint64_t requests, Moment now);

  Output take_output() { return std::exchange(output_, {}); }

 private:
  enum class Phase : std::uint8_t {
    reading,
    /// What is to be written, as it is now.
    before,
    writing,
    /// … and as it is then.
    after,
    listing
  };
  struct OpenRequest {
    fabric::VariableRequest request{};
    Phase phase = Phase::reading;
    /// What was answered from then on, counts.
    SteadyTime since{};
    SteadyTime deadline{};
    std::vector<VariableCacheEntry*> variables{};
    std::vector<fabric::Value> before{};
    std::vector<cnc::variables::Bytes> values{};
    std::size_t written = 0;
  };
  using OpenRequests = std::map<std::uint64_t, OpenRequest>;

  bool answered_before(const fabric::VariableRequest& request);
  [[nodiscard]] std::string wrong(const fabric::VariableRequest& request) const;
  [[nodiscard]] std::string too_much(const fabric::VariableRequest& request) const;
  [[nodiscard]] std::string unwritable(const fabric::VariableRequest& request, Moment now) const;
  void add(const fabric::VariableRequest& request, Moment now);
  OpenRequests::iterator remove(OpenRequests::iterator open);

  struct Batch;
  std::optional<Step> turn_of(std::uint64_t number, const OpenRequest& open);
  void add_to_batch(Batch& batch, const OpenRequest& open);
  std::optional<Step> start(Batch batch);

  /// Everything that can be answered now is.
  void complete(Moment now);
  /// True if the request is answered.
  bool complete(OpenRequest& open, Moment now);
  [[nodiscard]] std::string prepare(OpenRequest& open) const;
  void finish_read(const OpenRequest& open, Moment now);
  void clear_step();
  void expire(OpenRequest& open, Moment now);

  void answer(const fabric::VariableRequest& request, fabric::VariableReply reply, Moment now);
  void refuse(const fabric::VariableRequest& request, const std::string& reason, Moment now,
              std::vector<fabric::VariableResult> results = {});
  void report_write(const fabric::VariableRequest& request, bool done, const std::string& what,
                    Moment now);
  [[nodiscard]] static std::vector<fabric::VariableResult> results_of(const OpenRequest& open);

  std::string machine_;
  VariableSettings settings_;
  data::RateLimit rate_limit_;
  VariableCache cache_;
  std::size_t at_once_ = data::Sampler::most_together;
  bool up_ = false;
  std::string down_reason_ = "the controller has not answered yet";
  /// Since when each channel is served, also while the link is down.
  std::map<std::uint16_t, SteadyTime> served_;
  OpenRequests requests_;
  std::uint64_t last_number_ = 0;
  std::size_t names_ = 0;
  /// A step is under way: of these variables, or of this request.
  bool busy_ = false;
  std::vector<VariableCacheEntry*> under_way_;
  std::uint64_t request_under_way_ = 0;
  std::uint64_t step_ = 0;
  bool resolved_last_ = false;
  /// Writes that are done, by their tokens: who has not heard so asks again.
  std::deque<Output::Answer> done_writes_;
  data::RateLimit refusals_;
  std::uint64_t unreported_refusals_ = 0;
  Output output_;
};

}  // namespace millrace::gateway::variables
