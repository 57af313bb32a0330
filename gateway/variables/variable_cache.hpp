// What is known about the requested variables: how each is read, and its last value. Pure.
//
//   const auto entry = cache.of(1, "V.E.LIMIT");
//   cache.on_resolved(*entry, found, now);
//   cache.on_read(*entry, bytes, now);            // entry->result.value is good, entry->at is now
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/ads/device.hpp"
#include "cnc/ads/error.hpp"
#include "cnc/variables/value.hpp"
#include "fabric/data.hpp"
#include "fabric/variables.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::variables {

using Found = tl::expected<cnc::variables::Reading, cnc::variables::LookupError>;
using Answered = cnc::ads::Result<cnc::variables::Bytes>;

struct VariableCacheEntry {
  /// Nullopt until it is resolved.
  std::optional<cnc::variables::Reading> reading{};
  /// It was resolved and not read since: a refusal now is final.
  bool is_new = false;
  fabric::VariableResult result{};
  /// The time of that response.
  SteadyTime at = SteadyTime::min();
  /// The step that is being put together includes it.
  bool in_batch = false;
};

class VariableCache {
 public:
  /// Further ones are kept only while a request waits for them.
  static constexpr std::size_t most = 4'096;

  /// It is kept while a request needs it, which has it until then.
  std::shared_ptr<VariableCacheEntry> of(std::uint16_t channel, const std::string& name);

  static void on_resolved(VariableCacheEntry& entry, const Found& found, Moment now);
  /// A refusal of what was read before is not an answer: its handle may be another by now, and it
  /// is resolved again.
  static void on_read(VariableCacheEntry& entry, const Answered& answer, Moment now);

  /// All values may have changed.
  void forget_values();
  /// Everything may have changed, on a new link.
  void forget();
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  void forget_unneeded();

  std::map<std::pair<std::uint16_t, std::string>, std::shared_ptr<VariableCacheEntry>> all_;
};

// Values as text for logs and recordings, and errors for replies.

/// "3.5", "\"text\"", "[1, 2, 3]"; what is not printable ASCII becomes '?'.
std::string text_of(const fabric::Elements& elements);
/// The same for values in a request.
std::string text_of(const std::vector<std::string>& values);

/// The ADS error number from a controller; 0 for our own errors (no response, no link).
std::uint32_t ads_number(cnc::ads::ErrorCode code);

}  // namespace millrace::gateway::variables
