// Which requests sample the data groups of a controller, and when: merged over groups, within a
// budget, one request at a time. Pure.
//
//   Sampler sampler("press", settings);
//   sampler.on_up({1, 2}, now);
//   if (auto step = sampler.next(now)) …       // Resolve or Read: nothing more until its answer
//   sampler.on_read(answers, 1, true, now);
//   publish(sampler.take_output());              // samples, and lines for the log
//   wait_until(sampler.next_time(now.steady));
//
// Groups beyond the budget are sampled more slowly, in turn, and this is logged. A variable that
// the controller refuses does not slow the others: the refusal is logged once, and the variable is
// tried again now and then, since variables of NC programs appear and disappear.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/variables/value.hpp"
#include "fabric/data.hpp"
#include "gateway/data/group.hpp"
#include "gateway/data/rate_limit.hpp"
#include "gateway/outputs.hpp"

namespace millrace::gateway::data {

/// Find the types and addresses of these.
struct Resolve {
  std::uint16_t channel = 0;
  std::vector<std::string> names;
};
/// These are to be read; of one port.
struct Read {
  std::vector<cnc::variables::Reading> readings;
};
using Step = std::variant<Resolve, Read>;

/// The result of an event.
struct Output {
  std::vector<fabric::DataSample> samples;
  /// Groups that are not published any more, by their keys.
  std::vector<fabric::DataSample> left;
  std::vector<LogLine> lines;
};

class Sampler {
 public:
  /// Values in one request at most: a controller does them one after the other, and others wait.
  static constexpr std::size_t most_together = 64;
  /// Bytes of an answer that one request may ask for.
  static constexpr std::size_t most_bytes = 16'384;
  /// The pause before refused and unanswered variables are tried again.
  static constexpr std::chrono::seconds retry_refused{10};
  static constexpr std::chrono::seconds retry_silent{1};

  Sampler(std::string machine, const DataSettings& settings);

  /// The controller answers, and these of its channels are served; also when there are more.
  void on_up(const std::vector<std::uint16_t>& channels, SteadyTime now);
  /// The link is gone: a step under way is not answered any more.
  void on_down(const fabric::Message& reason, Moment now);
  /// The channel is not served any more, or none if 0. Another gateway may publish its groups now:
  /// they are in Output::left, and nothing more is published about them.
  void on_over(std::uint16_t channel, Moment now);

  /// The next request; nullopt while one is pending, or none is due.
  std::optional<Step> next(Moment now);
  /// When next() has something, nothing while something is under way.
  std::optional<SteadyTime> next_time(SteadyTime now);

  using Resolved = tl::expected<cnc::variables::Reading, cnc::variables::LookupError>;
  using Answer = cnc::ads::Result<cnc::variables::Bytes>;
  /// The results of the step, in its order, and the number of its requests. `sums`: the controller
  /// reads many values in one request.
  void on_resolved(const std::vector<Resolved>& known, std::uint64_t requests, Moment now);
  void on_read(const std::vector<Answer>& answers, std::uint64_t requests, bool sums, Moment now);

  /// The results since the last call.
  Output take_output() { return std::exchange(output_, {}); }

 private:
  struct Place {
    std::size_t group = 0;
    std::size_t item = 0;
  };

  Item& item(Place place) { return groups_.at(place.group).at(place.item); }
  std::optional<Step> resolve(SteadyTime now);
  std::optional<Step> read(Moment now);
  void take_answer(Place place, const Answer& answer, Moment now);
  static void refuse(Item& item, const fabric::Message& reason, SteadyTime again);
  void end_cycles(Moment now);
  void report_refused(const std::vector<Place>& places);
  void report_period(const Group& group);
  [[nodiscard]] std::string where(const Group& group) const;

  std::string machine_;
  std::vector<Group> groups_;
  RateLimit rate_limit_;
  std::size_t at_once_ = most_together;
  /// Of the step under way; empty = none is.
  std::vector<Place> under_way_;
  /// The budget has kept something waiting since a group was found slow.
  bool short_of_budget_ = false;
  Output output_;
};

}  // namespace millrace::gateway::data
