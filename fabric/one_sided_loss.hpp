// Finds a participant that this process has lost by its lease, while that participant still has
// this process. DDS Security does not bring the two together again: a participant answers the
// handshake of another one once, as long as it knows it (Cyclone DDS 0.10.2 and later; issue 1895
// there). Only a new participant is authenticated. Pure.
//
//   sut.on_authenticated(handle, {.guid_prefix = "110a1f2:7c03f1d2:1", .name = "square-root"});
//   sut.on_lost(handle);
//   sut.find(now, {"110a1f2:7c03f1d2:1"})      // "square-root", once it took too long
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "base/recent.hpp"

namespace millrace::fabric {

class OneSidedLoss {
 public:
  using Clock = std::chrono::steady_clock;
  /// Cyclone's instance handle of a participant.
  using Handle = std::uint64_t;
  struct Who {
    /// As dds::guid_prefix() has it; the same after the participant was lost and found again.
    std::string guid_prefix;
    /// In its certificate.
    std::string name;
  };
  /// Far more than are lost and announced at one time.
  static constexpr std::size_t most_lost = 1024;
  /// Between two calls of find(): this process itself stood still when they are further apart.
  static constexpr std::chrono::seconds standstill{5};

  /// `patience`: how long a participant that is announced again may take to authenticate itself.
  explicit OneSidedLoss(Clock::duration patience) : patience_(patience) {}

  void on_authenticated(Handle participant, Who who);
  void on_lost(Handle participant);
  /// False: find() cannot find any.
  [[nodiscard]] bool any() const { return lost_.size() > 0; }
  /// About once a second, with the GUID prefixes that announce themselves now. Returns the name of
  /// one that was authenticated, was lost, and is announced for longer than the patience since.
  std::optional<std::string> find(Clock::time_point now, const std::set<std::string>& announced);

 private:
  const Clock::duration patience_;
  std::unordered_map<Handle, Who> authenticated_;
  /// The name of each, by its GUID prefix.
  base::Recent<std::string, std::string> lost_{most_lost};
  /// Since when a lost one is announced again, by its GUID prefix.
  std::map<std::string, Clock::time_point> announced_;
  std::optional<Clock::time_point> last_;
};

}  // namespace millrace::fabric
