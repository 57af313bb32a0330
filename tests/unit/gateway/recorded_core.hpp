// A core with one machine, "cnc", that records its actions on calls: each step returns the output
// through its ports and over the machine's link, in its order.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/core/core.hpp"
#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway {

struct Read {
  ReadSet set = ReadSet::state;
};
struct Record {
  Ticket ticket;
  JournalEntry entry;
};
struct Publish {
  fabric::Request request;
};
struct Withdraw {
  fabric::InstanceId instance;
  std::uint64_t epoch = 0;
  bool operator==(const Withdraw&) const = default;
};
struct EmitEvent {
  fabric::Event event;
};
struct PublishStatus {
  fabric::ChannelStatus status;
};
struct RetractStatus {};
struct Log {
  Level level = Level::info;
  std::string text;
};
using Action = std::variant<Read, Write, Record, Publish, Withdraw, EmitEvent, PublishStatus,
                            RetractStatus, Log>;
using Actions = std::vector<Action>;

class ActionRecorder final : public core::RecordedPorts {
 public:
  Actions take() { return std::exchange(actions_, {}); }
  void add(Action action) { actions_.push_back(std::move(action)); }

 private:
  class RecordedLink final : public SilentLink {
   public:
    explicit RecordedLink(ActionRecorder& recorder) : recorder_(recorder) {}
    void read(std::uint16_t, ReadSet set) override { recorder_.add(Read{set}); }
    void write(std::uint16_t, Variable variable, const Value& value) override {
      recorder_.add(Write{variable, value});
    }

   private:
    ActionRecorder& recorder_;
  };

  using RecordedPorts::dispose;
  using RecordedPorts::publish;
  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings&) override {
    return std::make_unique<RecordedLink>(*this);
  }
  void append(const JournalEntry& entry, const Ticket& ticket) override {
    add(Record{ticket, entry});
  }
  void publish(const fabric::Request& request) override { add(Publish{request}); }
  void publish(const fabric::Event& event) override { add(EmitEvent{event}); }
  void publish(const fabric::ChannelStatus& status) override { add(PublishStatus{status}); }
  void dispose(const fabric::RequestKey& request) override {
    add(Withdraw{request.instance, request.epoch});
  }
  void dispose(const fabric::ChannelKey&) override { add(RetractStatus{}); }
  void log(Level level, const std::string& text) override { add(Log{level, text}); }

  Actions actions_;
};

class RecordedCore {
 public:
  /// It has listened for other gateways and is connecting.
  RecordedCore(Policies policies, const journal::JournalState& journal_state, Moment now)
      : core_(ports_, ports_,
              {.own = {gateway_id(5), "host1", 4711, "1", journal_state.numbers().epoch},
               .lease = std::chrono::seconds(2),
               .machines = {machine()},
               .policies = std::move(policies)},
              journal_state) {
    done({now.steady - listens, now.wall}, [&] { core_.start(); });
    done(now, [&] { core_.on_time(); });
  }

  Actions on_link_up(const std::string& machine, const machines::Channels& channels, Moment now) {
    core_.may_serve = true;
    Actions actions = done(now, [&] { core_.on_link_up(machine, channels); });
    core_.may_serve = false;
    return actions;
  }
  Actions on_link_dropped(const std::string& machine, const std::string& reason, Moment now) {
    return from_within(now, [&] { core_.on_link_dropped(machine, reason); });
  }
  Actions drain(const fabric::ChannelKey& key, Moment now) {
    return from_within(now, [&] { core_.on_channel_removed(key); });
  }
  Actions not_owner(const fabric::ChannelKey& key, const std::string& reason, Moment now) {
    return from_within(now, [&] { core_.on_not_owner(key, reason); });
  }
  Actions change(const Policies& policies, Moment now) {
    return done(now, [&] { core_.change({machine()}, policies); });
  }
  Actions on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot, Moment now) {
    return done(now, [&] { core_.on_read(key, snapshot); });
  }
  Actions on_write(const fabric::ChannelKey& key, WriteOutcome outcome, const std::string& reason,
                   Moment now) {
    return done(now, [&] { core_.on_write(key, outcome, reason); });
  }
  Actions on_recorded(const Ticket& ticket, Moment now) {
    return done(now, [&] { core_.on_recorded(ticket); });
  }
  Actions on_journal_error(const std::string& reason, Moment now) {
    return done(now, [&] { core_.on_journal_error(reason); });
  }
  Actions on_instance_ready(const fabric::InstanceIdentity& instance, Moment now) {
    return done(now, [&] { core_.on_instance_ready(instance); });
  }
  Actions on_instance_gone(const fabric::InstanceId& instance, Moment now) {
    return done(now, [&] { core_.on_instance_gone(instance); });
  }
  Actions on_reply(const fabric::Reply& reply, Moment now) {
    return done(now, [&] { core_.on_reply(reply); });
  }
  Actions on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                    const core::OperatorAnswer& answer, core::CommandResult& result, Moment now) {
    return done(now, [&] { result = core_.on_answer(key, call, answer); });
  }
  Actions on_retry(const fabric::ChannelKey& key, const fabric::CallId& call, const std::string& by,
                   core::CommandResult& result, Moment now) {
    return done(now, [&] { result = core_.on_retry(key, call, by); });
  }
  Actions set_readers(const Readers& readers, Moment now) {
    return done(now, [&] { core_.set_readers(readers); });
  }
  Actions end(Moment now) {
    return done(now, [&] { core_.end(); });
  }
  Actions on_time(Moment now) {
    return done(now, [&] {
      ports_.wakes_at.reset();
      core_.on_time();
    });
  }
  /// A previous gateway had this call on the channel.
  void predecessor_call(const fabric::ChannelKey& key, const std::string& uuid,
                        const std::string& from) {
    fabric::ChannelStatus status;
    status.key = key;
    status.uuid = uuid;
    core_.on_predecessor_call(status, from);
  }
  [[nodiscard]] machines::Channels channels_of(const std::string& machine) const {
    return core_.channels_of(machine);
  }
  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const { return core_.serves(key); }
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return ports_.wakes_at; }

 private:
  /// Its machines' events, too.
  class OpenedCore final : public core::Core {
   public:
    using Core::channels_of;
    using Core::Core;
    using Core::on_channel_removed;
    using Core::on_link_dropped;
    using Core::on_not_owner;
    using Core::on_predecessor_call;
    /// A channel that was retired or refused stays so until the link comes up again.
    bool may_serve = false;

   private:
    void on_serve(const std::string& machine, const machines::Channels& channels) override {
      if (may_serve) {
        Core::on_serve(machine, channels);
      }
    }
  };

  /// How long it listens for others before it connects.
  static constexpr std::chrono::milliseconds listens{300};

  static settings::MachineSettings machine() {
    settings::MachineSettings one;
    one.name = "cnc";
    one.watch = SubscriptionMode::poll;
    return one;
  }
  template <typename Step>
  Actions done(Moment now, Step step) {
    ports_.time = now;
    step();
    return ports_.take();
  }
  /// A step that is a part of another event.
  template <typename Step>
  Actions from_within(Moment now, Step step) {
    return done(now, [&] {
      core_.on_other_event();
      step();
      core_.on_other_event();
    });
  }

  ActionRecorder ports_;
  OpenedCore core_;
};

}  // namespace millrace::gateway
