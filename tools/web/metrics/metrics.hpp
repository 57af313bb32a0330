// The plant in numbers, for Prometheus: counts what an observer receives and reports it on request.
// Pure.
//
//   metrics.add(entry, plant.add(entry, now));          // each entry, with the call it ends
//   metrics.text(plant, server)                         // the answer to GET /metrics
//
// The number of series is bounded, because any participant can name services and machines: those
// beyond the limits are counted as "other".
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "fabric/observer/observer.hpp"
#include "tools/recording/completeness.hpp"
#include "tools/recording/hops.hpp"
#include "tools/web/metrics/families.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::metrics {

/// Figures of this process.
struct ProgramFigures {
  std::string version{};
  fabric::Time started{};
  fabric::observer::Counts bus{};
  std::size_t connections = 0;
  std::size_t browsers = 0;
  std::uint64_t requests = 0;
  std::uint64_t displaced = 0;
  std::uint64_t dropped = 0;
  /// Of its TLS certificate, if it has one.
  std::optional<fabric::Time> certificate_ends{};
  /// CPU time of the process; nothing where the system does not report it.
  std::optional<double> cpu_seconds{};
  std::optional<double> resident_bytes{};
  std::optional<double> open_files{};
};

class Metrics {
 public:
  /// So many of each have a label of their own.
  static constexpr std::size_t most_services = 200;
  static constexpr std::size_t most_call_series = 2'000;
  static constexpr std::size_t most_program_series = 2'000;

  Metrics();

  /// `ended`: the call that ends with the entry, or nullptr.
  void add(const recording::Entry& entry, const plant::EndedCall* ended);

  [[nodiscard]] std::string text(const plant::PlantModel& plant, const ProgramFigures& program,
                                 const fabric::Moment& now) const;

 private:
  /// Service, machine, result.
  using CallLabels = std::tuple<std::string, std::string, std::string>;
  /// Machine, channel, result.
  using ProgramLabels = std::tuple<std::string, std::uint16_t, std::string>;

  void add(const fabric::ProgramEvent& event, fabric::Time received);
  std::string known(std::set<std::string>& names, const std::string& name, std::size_t most);
  void put_calls(Families& families) const;
  void put_services(Families& families, const fabric::plant::Plant& live) const;
  void put_runs(Families& families) const;
  void put_program(Families& families, const ProgramFigures& program) const;

  recording::HopStatistics hops_;
  recording::Completeness completeness_;
  std::set<std::string> services_;
  std::set<std::string> machines_;
  /// Name and version by UUID, also of services without instances.
  std::map<std::string, std::string> names_;
  std::map<CallLabels, std::uint64_t> calls_;
  std::map<std::pair<std::string, recording::Hop>, Buckets> durations_;
  std::map<ProgramLabels, std::uint64_t> runs_;
  std::map<fabric::ChannelKey, fabric::ProgramEventKind> last_events_;
};

// The present state of the plant in numbers: channels, links, message queues, sampled values and
// alarms. Pure.
//
//   put_links(families, plant.live());
//
// The number of each is limited. What a machine has beyond the limit is counted as "other" or left
// out.

inline constexpr std::size_t most_machines = 200;
inline constexpr std::size_t most_channels = 2'000;
inline constexpr std::size_t most_alarms = 200;
inline constexpr std::size_t most_concerns = 200;
inline constexpr std::size_t most_queues = 1'000;

/// The state and the counters of each channel; by machine the calls that run and that wait.
void put_channels(Families& families, const fabric::plant::Plant& live);
/// Of each machine: whether it is connected, how it is read, and its gateways.
void put_links(Families& families, const fabric::plant::Plant& live);
/// What needs attention.
void put_concerns(Families& families, const std::vector<fabric::plant::Concern>& concerns);
/// The alarms of all processes.
void put_alarms(Families& families, const fabric::plant::Plant& live);
/// How many sampled values of each machine are good, stale, refused.
void put_data(Families& families, const plant::DataStore& data);
/// The fill level of each message queue, and how many messages were read and answered.
void put_queues(Families& families, const plant::DataStore& data);

}  // namespace millrace::tools::web::metrics
