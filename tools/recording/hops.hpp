// The duration of each hop of calls: pairs the samples of gateway and service for the same call.
//
//   HopStatistics hops;
//   hops.add(entry);                                  // in the order of the recording
//   hops.services().at(uuid).at(Hop::work).percentile(0.99)
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "tools/recording/call.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::tools::recording {

/// Parts of the way of a call. `to_service` and `to_gateway` compare clocks of two processes, which
/// may be on two hosts.
enum class Hop : std::uint8_t {
  /// Seen by the gateway → dispatched.
  dispatch,
  /// Dispatched → received by the instance.
  to_service,
  /// Received → the handler starts.
  queue,
  /// In the handler.
  work,
  /// Answered → the gateway has the reply.
  to_gateway,
  /// The gateway has the reply → RESPONSE_STATE is written.
  write_back,
  /// Seen → written.
  total,
};
inline constexpr std::size_t hop_count = 7;

/// "dispatch", "to service", …
std::string_view name_of(Hop hop);

using HopHistograms = std::array<Histogram, hop_count>;

/// Nothing where one of the two times is not known. Of the attempt whose response was written.
using HopTimes = std::array<std::optional<std::chrono::nanoseconds>, hop_count>;
HopTimes hops_of(const Call& call);

/// The samples of a call come from several writers, so they may be recorded out of order.
class HopStatistics {
 public:
  /// Called for each hop of each call that counts, by its canonical UUID.
  using Use = std::function<void(const std::string&, Hop, std::chrono::nanoseconds)>;

  /// A plant has some ten; a file can have millions, and the times of each take up to 100 kB.
  static constexpr std::size_t most_services = 1000;
  /// The name of those beyond.
  static constexpr const char* further_services = "(further services)";

  HopStatistics() = default;
  /// `use` counts instead; services() stays empty.
  explicit HopStatistics(Use use) : use_(std::move(use)) {}

  void add(const Entry& entry);
  /// Also counts calls that are answered but whose reply was not recorded. Call it at the end.
  void close();

  /// Calls that have ended, withdrawn ones too.
  [[nodiscard]] std::uint64_t ended() const { return ended_; }
  /// Those without a response by a service.
  [[nodiscard]] std::uint64_t failed() const { return failed_; }
  /// By canonical UUID. A call counts when its answer is written.
  [[nodiscard]] const std::map<std::string, HopHistograms>& services() const { return services_; }

 private:
  void count(const Call& call);
  void count_end(const Call& call);

  CallCollector calls_{Call::Texts::left_out};
  std::uint64_t ended_ = 0;
  std::uint64_t failed_ = 0;
  std::map<std::string, HopHistograms> services_;
  Use use_;
};

}  // namespace millrace::tools::recording
