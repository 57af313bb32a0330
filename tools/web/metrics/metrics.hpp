// The plant in numbers, for Prometheus: counted from what an observer sees, told when it is asked.
// Pure.
//
//   metrics.add(entry, plant.add(entry, now));          // each entry, with the call it ends
//   metrics.text(plant, server)                         // the answer to GET /metrics
//
// The number of series is bounded, whoever names services and machines: what is beyond is counted
// as "other".
#pragma once

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

/// What the program knows of itself.
struct ProgramFigures {
  std::string version{};
  fabric::Time started{};
  fabric::observer::Counts bus{};
  std::size_t connections = 0;
  std::size_t browsers = 0;
  std::uint64_t requests = 0;
  std::uint64_t displaced = 0;
  std::uint64_t dropped = 0;
  /// Of the certificate it shows, if it does TLS.
  std::optional<fabric::Time> certificate_ends{};
  /// Of the process; nothing where the system does not tell.
  std::optional<double> cpu_seconds{};
  std::optional<double> resident_bytes{};
  std::optional<double> open_files{};
};

class Metrics {
 public:
  /// Of each, so many are told apart.
  static constexpr std::size_t most_services = 200;
  static constexpr std::size_t most_call_series = 2'000;
  static constexpr std::size_t most_program_series = 2'000;

  Metrics();

  /// `ended`: the call that ends with the entry, or nullptr.
  void add(const recording::Entry& entry, const plant::EndedCall* ended);

  [[nodiscard]] std::string text(const plant::PlantModel& plant,
                                 const ProgramFigures& program) const;

 private:
  /// Service, machine, result.
  using CallLabels = std::tuple<std::string, std::string, std::string>;
  /// Machine, channel, result.
  using ProgramLabels = std::tuple<std::string, std::uint16_t, std::string>;

  void add(const fabric::ProgramEvent& event, fabric::Time received);
  std::string known(std::set<std::string>& names, const std::string& name, std::size_t most);
  void put_calls(Families& families) const;
  void put_services(Families& families, const bus::FabricModel& live) const;
  void put_runs(Families& families) const;
  void put_program(Families& families, const ProgramFigures& program) const;

  recording::HopStatistics hops_;
  recording::Completeness completeness_;
  std::set<std::string> services_;
  std::set<std::string> machines_;
  /// Name and version by UUID, also of services that have no instance any more.
  std::map<std::string, std::string> names_;
  std::map<CallLabels, std::uint64_t> calls_;
  std::map<std::pair<std::string, recording::Hop>, Buckets> durations_;
  std::map<ProgramLabels, std::uint64_t> runs_;
  std::map<fabric::ChannelKey, fabric::ProgramEventKind> last_events_;
};

}  // namespace millrace::tools::web::metrics
