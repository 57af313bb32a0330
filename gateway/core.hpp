// The gateway without its sockets: the sessions of all channels, the dispatcher, and who tells
// whom. Pure: takes events and times, returns actions for channels.
//
//   Core core(options, ledger);
//   carry_out(core.on_link_up("cnc", {1, 2}, now));       // Read for each channel
//   carry_out(core.on_read({"cnc", 1}, picture, now));
//   carry_out(core.on_instance_ready(identity, now));
//   arm_timer(core.next_time());                          // then core.on_time(now)
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/action.hpp"
#include "gateway/dispatcher.hpp"
#include "gateway/journal/ledger.hpp"
#include "gateway/session.hpp"

namespace millrace::gateway {

struct CoreOptions {
  /// By machine; one that is not here is looked at with the default pace.
  std::map<std::string, Pace> paces{};
  DispatcherOptions dispatcher{};
  Policies policies{};
};

/// What became of an operator's command.
struct Verdict {
  bool done = false;
  std::string detail;
};

/// One of Read, Write, WakeAt, Record, Publish, Withdraw, Tell, Show, Say, for one channel.
struct ChannelAction {
  fabric::ChannelKey key;
  Action action;
};
using ChannelActions = std::vector<ChannelAction>;

class Core {
 public:
  /// `ledger` is what the journal adds up to; its numbers must have an epoch.
  Core(CoreOptions options, const journal::Ledger& ledger);

  /// The controller answers; these are the channels to serve.
  ChannelActions on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels,
                            Moment now);
  ChannelActions on_link_down(const std::string& machine, const std::string& reason, Moment now);

  ChannelActions on_wake(const fabric::ChannelKey& key, Moment now);
  ChannelActions on_read(const fabric::ChannelKey& key, const Picture& picture, Moment now);
  ChannelActions on_read_failed(const fabric::ChannelKey& key, const std::string& reason,
                                Moment now);
  ChannelActions on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                          const std::string& reason, Moment now);
  ChannelActions on_recorded(const fabric::ChannelKey& key, std::uint64_t ticket, Moment now);

  ChannelActions on_instance_ready(const fabric::InstanceIdentity& identity, Moment now);
  ChannelActions on_instance_gone(const fabric::InstanceId& instance, Moment now);
  ChannelActions on_reply(const fabric::Reply& reply, Moment now);

  /// An operator answers a channel's call, or has it given out again. `call` must still be pending.
  ChannelActions on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                           const Settlement& settlement, Verdict& verdict, Moment now);
  ChannelActions on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                          const std::string& by, Verdict& verdict, Moment now);
  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const { return sessions_.contains(key); }

  /// Why no new call may be claimed (the journal is full); empty = claim again.
  ChannelActions set_obstacle(const std::string& reason, Moment now);

  /// An answer is on its way into a channel.
  [[nodiscard]] bool answering() const;

  ChannelActions on_time(Moment now);
  /// When on_time has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return dispatcher_.next_time(); }

 private:
  ChannelSession* find(const fabric::ChannelKey& key);
  ChannelSession& open(const fabric::ChannelKey& key);
  void run(ChannelSession& session, Actions actions, Moment now);
  void carry_out(const Decisions& decisions, Moment now);
  void answer_offer(ChannelSession& session, const Offer& offer, Moment now);
  ChannelSession* find_pending(const fabric::ChannelKey& key, const fabric::CallId& call,
                               Verdict& verdict);
  [[nodiscard]] Policy policy_of(const fabric::ChannelKey& key, const std::string& uuid) const;
  void reconsider(Moment now);
  fabric::CallId next_id(const fabric::ChannelKey& key);
  ChannelActions finish();

  CoreOptions options_;
  Dispatcher dispatcher_;
  std::map<fabric::ChannelKey, ChannelSession> sessions_;
  std::string obstacle_;
  std::uint64_t epoch_ = 0;
  std::uint64_t next_number_ = 0;
  std::uint64_t reserved_ = 0;
  ChannelActions out_;
};

}  // namespace millrace::gateway
