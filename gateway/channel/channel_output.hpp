// The actions of a channel: to the outside at once, and for its owner until the owner asks.
//
//   ChannelOutput out({"cnc", 1}, context);
//   const EntryNumber entry = out.append(AnsweredEntry{…});      // on_recorded(entry) follows
//   out.log(Level::info, "call … answered");
//   const ChannelNews news = out.take_news();
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "fabric/request_key.hpp"
#include "gateway/channel/answered_requests.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/moment.hpp"
#include "gateway/outputs.hpp"

namespace millrace::gateway::channel {

// Since when channels are blocked, and why: they wait for an operator, or no service has the UUID.
// The journal stores it, so that a restarted gateway shows the same. Pure.
//
//   blocked.note(status, now);
//   if (const BlockedEntry* entry = blocked.of(status)) …

class BlockedChannels {
 public:
  explicit BlockedChannels(Records& records) : records_(records) {}

  /// Takes over the entries of the journal.
  void resume(std::map<fabric::ChannelKey, BlockedEntry> known) { entries_ = std::move(known); }
  /// Stores that the channel is blocked, or that it is not any more. With `begins` false nothing
  /// new is stored: a full journal raises its own alarm.
  void note(const fabric::ChannelStatus& status, bool begins, Moment now);
  void forget(const fabric::ChannelKey& key);
  /// The stored entry for the same cause; nullptr if there is none.
  [[nodiscard]] const BlockedEntry* of(const fabric::ChannelStatus& status) const;

 private:
  Records& records_;
  std::map<fabric::ChannelKey, BlockedEntry> entries_;
};

/// Of an entry that the journal has not confirmed yet; 0 = none.
using EntryNumber = std::uint64_t;

/// No reason, no problem.
inline const fabric::Message no_reason;

/// The published state of a channel, without its counters.
struct ChannelView {
  fabric::ChannelState state = fabric::ChannelState::link_down;
  /// Never null, and outlives this.
  const fabric::Message* reason = &no_reason;
  std::string_view uuid{};
  fabric::CallId call{};
  std::uint32_t attempt = 0;
  /// The instance that has the call, or answered it.
  fabric::InstanceId instance{};
};

/// The shared state of all channels of a gateway.
struct ChannelContext {
  ChannelContext(CallTopics& own_fabric, Records& own_records)
      : fabric(own_fabric), records(own_records), blocked(own_records) {}

  CallTopics& fabric;
  Records& records;
  Readers readers{};
  /// Why the journal cannot be written; empty while it can. Waiting calls show it as their reason.
  fabric::Message journal_error{};
  AnsweredRequests answered{};
  BlockedChannels blocked;
  /// Counts the entries of all channels: a channel may leave and return before the journal confirms
  /// its earlier entries.
  EntryNumber last_entry = 0;
  /// The gateway that had a channel before us, by its epoch: its calls there are over.
  std::unordered_map<fabric::ChannelKey, std::uint64_t, fabric::ChannelKeyHash>
      predecessor_epochs{};
};

/// What a step of a channel means for the gateway, which acts in this order.
struct ChannelNews {
  struct Ended {
    fabric::CallId call;
    /// The answer stands in the channel.
    bool written = false;
  };

  /// Call on_wake at this time or before; replaces what was asked before.
  std::optional<SteadyTime> wake_at{};
  /// A read is under way.
  bool reads = false;
  /// A call of an earlier run still waits for its answer: the dispatcher takes it over again.
  bool resumed = false;
  /// The call was given out.
  std::optional<fabric::CallId> published{};
  /// The instance has declined this attempt: the call goes to another one.
  std::optional<fabric::CallId> declined{};
  /// The instance has answered, or the call is over: it is free for the next one.
  std::optional<Ended> ended{};
  /// A request was found: call accept() or leave_unserved() before anything else.
  bool found = false;
};

class ChannelOutput {
 public:
  /// `access` and `context` outlive this.
  ChannelOutput(fabric::ChannelKey key, ServiceAccess& access, ChannelContext& context)
      : access_(access), context_(context) {
    status_.key = std::move(key);
  }

  void read(ReadSet set) {
    news_.reads = true;
    access_.read(key(), set);
  }
  void write(const Write& write, Moment now) { access_.write(key(), write, now); }

  /// on_recorded(entry) is to follow.
  [[nodiscard]] EntryNumber append(const JournalEntry& entry);
  /// The same, without a callback.
  void append_untracked(const JournalEntry& entry) { context_.records.append(entry, {}); }

  void publish(fabric::Request request);
  /// Withdraws the call from an instance.
  void withdraw(const fabric::InstanceId& instance, const fabric::CallId& call);
  /// The instance has answered the call: it needs no notice, and the request is withdrawn when the
  /// channel is quiet.
  void add_answered(const fabric::InstanceId& instance, const fabric::CallId& call, Moment now) {
    context_.answered.add({key(), call.epoch, instance}, now.steady);
  }

  /// Whether an event, or a line of this level, has a reader. Frequent messages are built only if
  /// it has.
  [[nodiscard]] bool events_wanted() const { return context_.readers.events; }
  [[nodiscard]] bool wanted(Level level) const { return level >= context_.readers.min_level; }
  /// Adds the channel and the time.
  void publish(fabric::Event event, Moment now);
  void log(Level level, const std::string& text);
  /// The write that the controller acknowledged and does not show; empty once there is none.
  void report_write_problem(const fabric::Message& problem);
  /// Publishes the changes, or everything for a new reader; `view` refers to nothing of this
  /// object.
  void publish_status(const ChannelView& view, Moment now);
  /// Publishes the channel as idle for the last time, whatever its state.
  void publish_idle(const fabric::Message& reason, Moment now);

  /// For the gateway.
  ChannelNews& news() { return news_; }
  void end(const fabric::CallId& call, bool written = false) { news_.ended = {call, written}; }
  ChannelNews take_news() { return std::exchange(news_, {}); }

  [[nodiscard]] const fabric::Message& journal_error() const { return context_.journal_error; }
  [[nodiscard]] const fabric::ChannelKey& key() const { return status_.key; }
  /// The last status, with the present counters.
  [[nodiscard]] const fabric::ChannelStatus& status() const { return status_; }
  /// To count calls, answers and so on.
  fabric::ChannelStatus& counters() { return status_; }

 private:
  void update(const ChannelView& view, Moment now);
  void publish(const fabric::ChannelStatus& status);

  ServiceAccess& access_;
  ChannelContext& context_;
  ChannelNews news_;
  fabric::ChannelStatus status_;
  /// Nothing was to be shown yet.
  bool fresh_ = true;
  fabric::Message write_problem_;
  /// The last published status, if it has had readers since.
  std::optional<fabric::ChannelStatus> published_;
};

}  // namespace millrace::gateway::channel
