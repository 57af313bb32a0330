// A call control that says what it has done: each step returns what went out through its port, in
// its order.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/control/call_control.hpp"

namespace millrace::gateway {

struct Read {
  ReadSet look = ReadSet::state;
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
struct Tell {
  fabric::Event event;
};
struct Show {
  fabric::ChannelStatus status;
};
struct Hide {};
struct Say {
  Level level = Level::info;
  std::string text;
};
struct WriteProblem {
  std::string text;
};
using Action =
    std::variant<Read, Write, Record, Publish, Withdraw, Tell, Show, Hide, Say, WriteProblem>;

struct Done {
  /// None of what the journal is told.
  fabric::ChannelKey key;
  Action action;
};
using Actions = std::vector<Done>;

class Recorder : public Outputs {
 public:
  Actions take() { return std::exchange(actions_, {}); }

 private:
  void read(const fabric::ChannelKey& key, ReadSet look) override { add(key, Read{look}); }
  void write(const fabric::ChannelKey& key, const Write& write) override { add(key, write); }
  void record(const JournalEntry& entry, const Ticket& ticket) override {
    add({}, Record{ticket, entry});
  }
  void publish(const fabric::Request& request) override { add(request.key, Publish{request}); }
  void publish(const fabric::Event& event) override { add(event.key, Tell{event}); }
  void publish(const fabric::ChannelStatus& status) override { add(status.key, Show{status}); }
  void dispose(const fabric::RequestKey& request) override {
    add(request.key, Withdraw{request.instance, request.epoch});
  }
  void dispose(const fabric::ChannelKey& key) override { add(key, Hide{}); }
  void say(const fabric::ChannelKey& key, Level level, const std::string& text) override {
    add(key, Say{level, text});
  }
  void tell_write_problem(const fabric::ChannelKey& key, const std::string& text) override {
    add(key, WriteProblem{text});
  }
  void add(const fabric::ChannelKey& key, Action action) {
    actions_.push_back({key, std::move(action)});
  }

  Actions actions_;
};

class RecordedControl {
 public:
  RecordedControl(control::CallControlOptions options, const journal::Ledger& ledger)
      : control_(port_, std::move(options), ledger) {}

  Actions on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels,
                     Moment now) {
    return done([&] { control_.on_link_up(machine, channels, now); });
  }
  Actions on_link_dropped(const std::string& machine, const std::string& reason, Moment now) {
    return done([&] { control_.on_link_dropped(machine, reason, now); });
  }
  Actions retire(const fabric::ChannelKey& key, Moment now) {
    return done([&] { control_.retire(key, now); });
  }
  Actions release(const fabric::ChannelKey& key, const std::string& reason, Moment now) {
    return done([&] { control_.release(key, reason, now); });
  }
  Actions change(std::map<std::string, Pace> paces, Policies policies, Moment now) {
    return done([&] { control_.change(std::move(paces), std::move(policies), now); });
  }
  Actions on_read(const fabric::ChannelKey& key, const Snapshot& snapshot, Moment now) {
    return done([&] { control_.on_read(key, snapshot, now); });
  }
  Actions on_write(const fabric::ChannelKey& key, WriteOutcome outcome, const std::string& reason,
                   Moment now) {
    return done([&] { control_.on_write(key, outcome, reason, now); });
  }
  Actions on_recorded(const Ticket& ticket, Moment now) {
    return done([&] { control_.on_recorded(ticket, now); });
  }
  Actions on_instance_ready(const fabric::InstanceIdentity& instance, Moment now) {
    return done([&] { control_.on_instance_ready(instance, now); });
  }
  Actions on_instance_gone(const fabric::InstanceId& instance, Moment now) {
    return done([&] { control_.on_instance_gone(instance, now); });
  }
  Actions on_reply(const fabric::Reply& reply, Moment now) {
    return done([&] { control_.on_reply(reply, now); });
  }
  Actions on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                    const control::OperatorAnswer& answer, control::Verdict& verdict, Moment now) {
    return done([&] { verdict = control_.on_answer(key, call, answer, now); });
  }
  Actions on_retry(const fabric::ChannelKey& key, const fabric::CallId& call, const std::string& by,
                   control::Verdict& verdict, Moment now) {
    return done([&] { verdict = control_.on_retry(key, call, by, now); });
  }
  Actions set_obstacle(const std::string& reason, Moment now) {
    return done([&] { control_.set_obstacle(reason, now); });
  }
  Actions set_journal_trouble(const std::string& reason, Moment now) {
    return done([&] { control_.set_journal_trouble(reason, now); });
  }
  Actions set_interest(const Interest& interest, Moment now) {
    return done([&] { control_.set_interest(interest, now); });
  }
  Actions take_back(Moment now) {
    return done([&] { control_.take_back(now); });
  }
  Actions on_time(Moment now) {
    return done([&] { control_.on_time(now); });
  }
  void inherit(const fabric::ChannelKey& key, control::Inheritance inheritance) {
    control_.inherit(key, std::move(inheritance));
  }
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string& machine) const {
    return control_.channels_of(machine);
  }
  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const { return control_.serves(key); }
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return control_.next_time(); }

 private:
  template <typename Step>
  Actions done(Step step) {
    step();
    return port_.take();
  }

  Recorder port_;
  control::CallControl control_;
};

}  // namespace millrace::gateway
