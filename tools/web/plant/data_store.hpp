// Machine data: the last sample of each group, and the values of the last minutes for lines over
// time. Pure.
//
//   store.add(sample, received);                        // each of them, as it comes
//   store.samples({.machine = "press"})                 // as `millrace data --json`
//   store.history("press", {{.variable = "1/axes/V.A.ACT_POS.X"}}, now)
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/data.hpp"
#include "tools/web/plant/series.hpp"

namespace millrace::tools::web::plant {

/// An empty text and channel 0 match everything.
struct DataFilter {
  std::string machine{};
  std::uint16_t channel = 0;
  std::string group{};
  /// Of a longer array only the first elements are returned, with their total number ("elements").
  std::size_t most_elements = std::numeric_limits<std::size_t>::max();
};

/// A requested line over time.
struct LineRequest {
  /// "1/axes/V.A.ACT_POS.X": channel, group and name.
  std::string variable{};
  /// The reader has the line up to this time; zero = nothing.
  fabric::Time since{};
};

class DataStore {
 public:
  /// Any participant can publish anything, so everything is limited.
  struct Limits {
    std::size_t groups = 1'000;
    std::size_t variables = 10'000;
    /// Of all lines together; each has an equal share of at most 7,200. 24 MiB.
    std::size_t points = 1'500'000;
    /// Of texts and arrays: the last values of each; 4 MiB.
    std::size_t changes = 20'000;
    /// Larger samples are left out, and so are new groups when all together take this much.
    std::size_t bytes_of_group = std::size_t{1} << 20U;
    std::size_t bytes = std::size_t{16} << 20U;
  };

  DataStore() : DataStore(Limits{}) {}
  explicit DataStore(Limits limits) : limits_(limits) {}

  /// A sample without values removes the group.
  void add(const fabric::DataSample& sample, fabric::Time received);
  /// The machine has lost its gateway: all values are unknown from `now` on.
  void silence(const std::string& machine, fabric::Time now);
  /// The machine has a gateway again. A gateway sends a group only when a value changes. So the
  /// last values hold if it is the `same` gateway; another gateway sends all of its groups.
  void end_silence(const std::string& machine, bool same, fabric::Time now);
  /// Drops groups without a sample for as long as lines are kept.
  void forget_old(fabric::Time now);

  /// An object for each group, with the fields of `millrace data --json`.
  [[nodiscard]] boost::json::array samples(const DataFilter& filter) const;
  /// {time, series}: of each known line the points since then, and its present value.
  [[nodiscard]] boost::json::object history(const std::string& machine,
                                            const std::vector<LineRequest>& wanted,
                                            fabric::Time now) const;

  [[nodiscard]] std::size_t groups() const { return groups_.size(); }
  [[nodiscard]] std::size_t variables() const { return variables_; }
  /// Groups that were left out, counted once until they are gone.
  [[nodiscard]] std::size_t left_out() const { return left_out_.size(); }

  /// Adds the machines that have groups.
  void add_machines(std::set<std::string>& names) const;
  /// The number of values of each quality, by machine.
  [[nodiscard]] std::map<std::pair<std::string, fabric::Quality>, std::size_t> qualities() const;
  /// The groups of message queues; valid until the next entry.
  [[nodiscard]] std::vector<const fabric::DataSample*> queues() const;

 private:
  /// The value of a text or an array from a time on.
  struct Change {
    fabric::Time at{};
    std::string text{};
  };
  struct Variable {
    Series series{};
    std::deque<Change> changes{};
  };
  struct Group {
    fabric::DataSample last{};
    fabric::Time received{};
    std::size_t bytes = 0;
    /// The group was removed.
    bool is_gone = false;
    /// Unknown because the machine has no gateway.
    bool is_silent = false;
    std::map<std::string, Variable> variables{};
  };
  using Key = std::pair<fabric::ChannelKey, std::string>;

  Group* group_for(const Key& key, const fabric::DataSample& sample);
  void add(Variable& variable, const fabric::Value& value, fabric::Time at);
  void forget(Group& group, fabric::Time now);
  void drop(std::map<Key, Group>::iterator group);
  void share_again();
  [[nodiscard]] static boost::json::object line_of(const Key& key, const Group& group,
                                                   const fabric::Value& value,
                                                   const Variable& variable, fabric::Time since);

  Limits limits_;
  std::map<Key, Group> groups_;
  /// With the time of the last sample.
  std::map<Key, fabric::Time> left_out_;
  std::size_t variables_ = 0;
  std::size_t bytes_ = 0;
  std::size_t most_points_ = 0;
  std::size_t most_changes_ = 0;
};

}  // namespace millrace::tools::web::plant
