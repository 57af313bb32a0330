// The last calls, from the samples that an observer receives. Pure.
//
//   CallList calls(20);
//   calls.add(entry);                        // any entry
//   print_listing(listing(), calls.rows(), flags);
#pragma once

#include <deque>
#include <map>
#include <vector>

#include "tools/print/listing.hpp"
#include "tools/recording/call_follower.hpp"

namespace millrace::tools::commands::calls {

struct CallRow {
  recording::FollowedCall call{};
  /// "dispatched", "answered", "written": the last known step.
  std::string state{};
  /// Time of the last known step.
  fabric::Time at{};
  /// From seen to ended; otherwise the time in the handler.
  std::optional<std::chrono::nanoseconds> took{};
};

class CallList {
 public:
  /// Keeps the last `most` calls.
  explicit CallList(std::size_t most) : most_(most) {}

  void add(const recording::Entry& entry);
  /// The oldest first.
  [[nodiscard]] std::vector<CallRow> rows() const;

 private:
  void add(const fabric::Request& request);
  void add(const fabric::Reply& reply, const std::string& uuid);
  CallRow& row_of(const fabric::CallId& id, const fabric::ChannelKey& key);

  std::size_t most_;
  recording::CallFollower follower_;
  std::map<fabric::CallId, CallRow> rows_;
  /// In the order of their first samples.
  std::deque<fabric::CallId> order_;
  std::map<fabric::InstanceId, std::pair<std::string, std::string>> names_;
};

const print::Listing<CallRow>& listing();

}  // namespace millrace::tools::commands::calls
