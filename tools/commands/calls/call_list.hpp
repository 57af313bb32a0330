// The last calls, from the samples that an observer receives. Pure.
//
//   CallList calls(20);
//   calls.add(entry);                        // any entry
//   print_listing(listing(), calls.rows(), flags);
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/recent.hpp"
#include "tools/print/listing.hpp"
#include "tools/recording/call.hpp"

namespace millrace::tools::commands::calls {

struct CallRow {
  recording::Call call{};
  std::string uuid{};
  std::uint32_t attempt = 0;
  /// That has or had the last attempt.
  recording::InstanceNames::Name instance{};
  /// What became of it ("answered", "failed", "settled", "withdrawn"), or the last known step
  /// ("dispatched", "held").
  std::string state{};
  /// Time of the last known step.
  fabric::Time at{};
  /// From seen to written; nullopt if one of them is not known.
  std::optional<std::chrono::nanoseconds> took{};
  /// The step with the response, if there is one.
  std::optional<recording::Step> response{};
};

class CallList {
 public:
  /// Keeps the last `most` calls.
  explicit CallList(std::size_t most) : calls_(most) {}

  void add(const recording::Entry& entry);
  /// The newest first.
  [[nodiscard]] std::vector<CallRow> rows() const;

 private:
  struct Known {
    recording::Call call;
    /// Of its channel, where nothing else is known of the call.
    std::optional<fabric::ChannelStatus> status{};
  };
  Known& known(const fabric::CallId& id, const fabric::ChannelKey& key);
  [[nodiscard]] CallRow row_of(const Known& known) const;

  base::Recent<fabric::CallId, Known> calls_;
  recording::InstanceNames names_;
};

const print::Listing<CallRow>& listing();
/// With times instead of ages.
const print::Listing<CallRow>& recorded_listing();

}  // namespace millrace::tools::commands::calls
