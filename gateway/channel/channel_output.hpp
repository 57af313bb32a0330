// What a channel gives out: actions in the order in which they are to be carried out, and what
// people and tools see of it.
//
//   ChannelOutput out({"cnc", 1});
//   const EntryNumber entry = out.record(AnsweredEntry{…});      // on_recorded(entry) follows
//   out.say(Level::info, "call … answered");
//   return out.take();
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/action.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::channel {

/// Of an entry that the journal has not confirmed yet; 0 = none.
using EntryNumber = std::uint64_t;

/// What a channel shows at the moment, beside its counters.
struct ChannelView {
  fabric::ChannelState state = fabric::ChannelState::link_down;
  std::string_view reason{};
  std::string_view uuid{};
  fabric::CallId call{};
  std::uint32_t attempt = 0;
  /// Who has the call, or has answered it.
  fabric::InstanceId instance{};
};

/// What the outputs of a gateway's channels share.
struct Commons {
  Interest interest{};
  /// Why the journal cannot be written; empty while it can. What waits for it says so.
  std::string journal_trouble{};
  /// Memory for actions: whoever has carried out what take() gave may put it here, emptied.
  std::vector<SessionActions> spare{};
};

class ChannelOutput {
 public:
  /// `commons` outlives this; null: everybody listens.
  explicit ChannelOutput(fabric::ChannelKey key, Commons* commons = nullptr) : commons_(commons) {
    status_.key = std::move(key);
  }

  void put(SessionAction action);
  /// on_recorded(entry) is to follow.
  [[nodiscard]] EntryNumber record(JournalEntry entry);
  /// The same, and nobody waits for it.
  void note(JournalEntry entry) { put(Record{{}, std::move(entry)}); }
  /// Whether an event, or a line of this level, is worth its words. Whoever says something in each
  /// call asks first.
  [[nodiscard]] bool hears_events() const { return commons_ == nullptr || interest().events; }
  [[nodiscard]] bool hears(Level level) const {
    return commons_ == nullptr || level >= interest().least;
  }
  /// Adds the channel and the time.
  void tell(fabric::Event event, Moment now);
  void say(Level level, std::string text) {
    if (hears(level)) {
      put(Say{level, std::move(text)});
    }
  }
  /// Shows what is new in it, or, if nobody had looked until now, all; `view` refers to nothing of
  /// this object.
  void show(const ChannelView& view, Moment now);
  /// Shows an idle channel, for the last time and whatever stands in it.
  void show_idle(const std::string& reason, Moment now);

  /// All that was put since.
  SessionActions take() { return std::exchange(actions_, {}); }

  [[nodiscard]] std::string_view journal_trouble() const {
    return commons_ == nullptr ? std::string_view() : commons_->journal_trouble;
  }
  [[nodiscard]] const fabric::ChannelKey& key() const { return status_.key; }
  /// As it was to be shown last, with the counters as of now.
  [[nodiscard]] const fabric::ChannelStatus& status() const { return status_; }
  /// To count calls, answers and so on.
  fabric::ChannelStatus& counters() { return status_; }

 private:
  [[nodiscard]] const Interest& interest() const { return commons_->interest; }
  void note(const ChannelView& view, Moment now);

  Commons* commons_;
  SessionActions actions_;
  fabric::ChannelStatus status_;
  /// Nothing was to be shown yet.
  bool fresh_ = true;
  /// What was shown last, if somebody has looked since.
  std::optional<fabric::ChannelStatus> shown_;
  EntryNumber last_entry_ = 0;
};

}  // namespace millrace::gateway::channel
