// A core with the channels 1 and 2 of the machine "cnc", the state of its journal, and its time.
#pragma once

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/core/core.hpp"
#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway {

// A core with one machine, "cnc", that records its actions on calls: each step returns the output
// through its ports and over the machine's link, in its order.

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
  [[nodiscard]] core::CallCounts counts() const { return core_.counts(); }
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return ports_.wakes_at; }
  /// As it was published last.
  [[nodiscard]] const fabric::MachineStatus& machine_status() const {
    return ports_.machine_status;
  }

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
    settings::MachineSettings machine_settings;
    machine_settings.name = "cnc";
    machine_settings.watch = SubscriptionMode::poll;
    return machine_settings;
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

class CoreCallsTest : public testing::Test {
 protected:
  inline static const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

  static fabric::InstanceIdentity instance(std::uint8_t number) {
    fabric::InstanceIdentity identity;
    identity.id.bytes.fill(number);
    identity.uuid = uuid;
    return identity;
  }
  static fabric::InstanceIdentity at_most_once(std::uint8_t number) {
    fabric::InstanceIdentity identity = instance(number);
    identity.delivery = fabric::Delivery::at_most_once;
    return identity;
  }

  CoreCallsTest() { journal_state.apply(NumbersEntry{7, 1000}); }

  void start(const Policies& policies = {}) { sut.emplace(policies, journal_state, now); }

  /// Started, with a link and this instance.
  void start_with(const fabric::InstanceIdentity& instance) {
    start();
    link_up();
    sut->on_instance_ready(instance, now);
  }

  /// A request in the order in which the channel reads it: state, texts, state again.
  Actions request(std::uint16_t channel, const std::string& wanted = uuid,
                  std::uint32_t state = 1) {
    const fabric::ChannelKey key{"cnc", channel};
    sut->on_read(key, {ReadSet::state, "", "", state, 0, ""}, now);
    sut->on_read(key, {ReadSet::texts, wanted, "2", 0, 0, ""}, now);
    return sut->on_read(key, {ReadSet::request, wanted, "2", state, 0, ""}, now);
  }

  /// Confirms the records in `actions`; returns the resulting actions.
  Actions confirm(const Actions& actions) {
    Actions all;
    for (const Action& action : actions) {
      if (const auto* record = std::get_if<Record>(&action)) {
        journal_state.apply(record->entry);
        std::ranges::copy(sut->on_recorded(record->ticket, now), std::back_inserter(all));
      }
    }
    return all;
  }

  /// An instance "marker", which runs a call at most once, gets the one of channel 1 and is gone.
  void lose_instance_of_a_call() {
    auto once = instance(1);
    once.name = "marker";
    once.delivery = fabric::Delivery::at_most_once;
    sut->on_instance_ready(once, now);
    confirm(request(1));
    sut->on_instance_gone(once.id, now);
  }

  /// A call from its request to the read after its answer; returns the actions of all steps.
  Actions answered_call(std::uint16_t channel) {
    const fabric::ChannelKey key{"cnc", channel};
    ServiceSnapshot shown{ReadSet::all, uuid, "2", 1, 0, ""};
    Actions todo = request(channel);
    for (std::size_t next = 0; next < todo.size(); ++next) {
      const Action action = todo[next];
      Actions more;
      if (const auto* record = std::get_if<Record>(&action)) {
        journal_state.apply(record->entry);
        more = sut->on_recorded(record->ticket, now);
      } else if (const auto* given = std::get_if<Publish>(&action)) {
        more = sut->on_reply(answer_to(given->request), now);
      } else if (const auto* write = std::get_if<Write>(&action)) {
        if (write->variable == Variable::response) {
          shown.response = std::get<std::string>(write->value);
        } else {
          auto& state = write->variable == Variable::request_state ? shown.request_state
                                                                   : shown.response_state;
          state = std::get<std::uint32_t>(write->value);
        }
        more = sut->on_write(key, WriteOutcome::written, "", now);
      } else if (const auto* read = std::get_if<Read>(&action)) {
        shown.set = read->set;
        more = sut->on_read(key, shown, now);
      }
      std::ranges::copy(more, std::back_inserter(todo));
    }
    return todo;
  }

  static fabric::Reply answer_to(const fabric::Request& request) {
    return reply_to(request, "1.414", 1);
  }

  template <typename Wanted>
  static std::vector<Wanted> all(const Actions& actions) {
    std::vector<Wanted> found;
    for (const Action& action : actions) {
      if (const auto* wanted = std::get_if<Wanted>(&action)) {
        found.push_back(*wanted);
      }
    }
    return found;
  }

  void link_up() { confirm(sut->on_link_up("cnc", {1, 2}, now)); }

  journal::JournalState journal_state;
  std::optional<RecordedCore> sut;
  Moment now{SteadyTime(std::chrono::hours(1)), fabric::Time(std::chrono::hours(1))};
};

}  // namespace millrace::gateway
