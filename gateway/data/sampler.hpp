// What is asked of a controller, and when, so that each group of its data is sampled on its cycle:
// merged over groups, within a budget, one request at a time. Pure.
//
//   Sampler sampler("press", settings);
//   sampler.on_up({1, 2}, now);
//   if (auto step = sampler.next(now)) …       // Resolve or Read: nothing more until its answer
//   sampler.on_read(answers, 1, true, now);
//   publish(sampler.take_output());              // samples, and lines for the log
//   wait_until(sampler.next_time(now.steady));
//
// What the budget does not allow for is sampled more slowly, each group in its turn, and that is
// said. A variable that the controller refuses costs the others nothing: it is refused, said once,
// and tried again now and then, since what a program has comes and goes.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/variables/reading.hpp"
#include "fabric/data.hpp"
#include "gateway/data/group.hpp"
#include "gateway/data/rate_limit.hpp"
#include "gateway/readers.hpp"

namespace millrace::gateway::data {

/// What these are, is to be found out.
struct Resolve {
  std::uint16_t channel = 0;
  std::vector<std::string> names;
};
/// These are to be read; of one port.
struct Read {
  std::vector<cnc::variables::Reading> readings;
};
using Step = std::variant<Resolve, Read>;

/// What comes of an event.
struct Output {
  std::vector<fabric::DataSample> samples;
  /// Groups of which we have nothing more to tell, by their keys.
  std::vector<fabric::DataSample> left;
  struct Line {
    Level level = Level::info;
    std::string text;
  };
  std::vector<Line> lines;
};

class Sampler {
 public:
  /// Values in one request at most: a controller does them one after the other, and others wait.
  static constexpr std::size_t most_together = 64;
  /// Bytes of an answer that one request may ask for.
  static constexpr std::size_t most_bytes = 16'384;
  /// Until what the controller refuses is tried again, and what it did not answer.
  static constexpr std::chrono::seconds retry_refused{10};
  static constexpr std::chrono::seconds retry_silent{1};

  Sampler(std::string machine, const DataSettings& settings);

  /// The controller answers, and these of its channels are served; also when there are more.
  void on_up(const std::vector<std::uint16_t>& channels, SteadyTime now);
  /// The link is gone: a step under way is not answered any more.
  void on_down(const std::string& reason, Moment now);
  /// The channel is not served any more, or none with 0. Somebody else may tell of its groups now:
  /// they are in Output::left, and nothing more is said of them.
  void on_over(std::uint16_t channel, Moment now);

  /// What to ask now; nothing while something is under way, or nothing is due.
  std::optional<Step> next(Moment now);
  /// When next() has something, nothing while something is under way.
  std::optional<SteadyTime> next_time(SteadyTime now);

  using Resolved = tl::expected<cnc::variables::Reading, cnc::variables::Trouble>;
  using Answer = cnc::ads::Result<cnc::variables::Bytes>;
  /// What came of the step, in its order, and how many requests that took. `sums`: the controller
  /// reads many values in one request.
  void on_resolved(const std::vector<Resolved>& known, std::uint64_t requests, Moment now);
  void on_read(const std::vector<Answer>& answers, std::uint64_t requests, bool sums, Moment now);

  /// What has come of all this since it was last asked for.
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
  static void refuse(Item& item, const std::string& reason, SteadyTime again);
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
