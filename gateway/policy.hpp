// The response to an NC program when its call cannot be answered, where that is configured. The
// default is to wait, as the vendor's manual does; only a response that cannot be written is
// replaced by an error at once.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace millrace::gateway {

struct Rule {
  /// How long to wait first.
  std::chrono::milliseconds after{};
  /// RESPONSE_STATE in this case; 0 = only log that the time is over.
  std::uint32_t response_state = 0;
  bool operator==(const Rule&) const = default;
};

struct Policy {
  /// No service has the UUID. Without a rule nothing is written: a service made with the vendor's
  /// SDK may use the same channel.
  std::optional<Rule> unserved{};
  /// No answer since the request was seen.
  std::optional<Rule> deadline{};
  /// The instance of an at-most-once call is lost.
  std::optional<Rule> lost{};
  /// The service's answer cannot be written (gateway/response.hpp). Without a rule the program gets
  /// an error of state 500; with one of state 0 the call is held for an operator. At once, whatever
  /// `after` says.
  std::optional<Rule> refused{};
  bool operator==(const Policy&) const = default;

  /// The rules of `other` have priority.
  [[nodiscard]] Policy overlaid_by(const Policy& other) const {
    return {other.unserved ? other.unserved : unserved, other.deadline ? other.deadline : deadline,
            other.lost ? other.lost : lost, other.refused ? other.refused : refused};
  }
};

/// The policies of a gateway: for all, for a machine, for a service; the most specific has
/// priority.
struct Policies {
  Policy everywhere{};
  std::map<std::string, Policy> by_machine{};
  /// By canonical UUID.
  std::map<std::string, Policy> by_uuid{};
  bool operator==(const Policies&) const = default;

  [[nodiscard]] Policy of(const std::string& machine, const std::string& uuid) const {
    Policy policy = everywhere;
    if (const auto found = by_machine.find(machine); found != by_machine.end()) {
      policy = policy.overlaid_by(found->second);
    }
    if (const auto found = by_uuid.find(uuid); found != by_uuid.end()) {
      policy = policy.overlaid_by(found->second);
    }
    return policy;
  }
};

}  // namespace millrace::gateway
