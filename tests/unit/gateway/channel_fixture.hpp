// One channel with a Service Interface, for tests: executes the channel's actions at once, and
// records them.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "gateway/channel/channel.hpp"
#include "gateway/journal/journal_state.hpp"
#include "tests/support/service_interface.hpp"

namespace millrace::gateway {

inline const std::string square_root_uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47";

inline fabric::InstanceId instance(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

/// A valid answer.
inline Response response(const std::string& text, std::uint32_t state) {
  return Response::of(text, state).value();
}

/// Entries that the journal received while it did not work.
struct Unconfirmed {
  Ticket ticket;
  JournalEntry entry;
};

/// The result of one write.
struct WriteResult {
  WriteOutcome outcome = WriteOutcome::written;
  bool executed = true;
};

class ChannelFixture final : public ServiceAccess, public CallTopics, public Records {
 public:
  explicit ChannelFixture(tests::KernelRules rules = {}) : channel(rules) {
    journal_state.apply(NumbersEntry{0x5f3a, 0});
    now.wall = fabric::Time(std::chrono::hours(24 * 365 * 50));
    now.steady = SteadyTime(std::chrono::hours(1));
    channel.advance(now.steady);
  }

  /// Does everything that is possible without waiting.
  void settle() {
    follow();
    while (!todo_.empty() && !stop) {
      const auto next = std::move(todo_.front());
      todo_.pop_front();
      next();
      follow();
    }
  }

  void link_up() {
    sut->on_link_up(now);
    settle();
  }

  /// Lets time pass; wakes the channel whenever it asked for it.
  void wait(std::chrono::milliseconds time) {
    const SteadyTime end = now.steady + time;
    while (!stop && wake && *wake <= end) {
      move_to(*std::exchange(wake, std::nullopt));
      sut->on_wake(now);
      settle();
    }
    if (!stop) {
      move_to(end);
    }
  }

  /// A new channel of the same controller.
  void renew() { sut.emplace(fabric::ChannelKey{"cnc", 1}, *this, *context, controller); }

  /// The gateway's process is killed and restarts; only journal and channel survive.
  void restart() {
    todo_.clear();
    wake.reset();
    stop = false;
    sut.reset();
    context.emplace(*this, *this);
    controller = {};
    renew();
    for (const CallRecord& call : journal_state.open_calls()) {
      sut->resume(call, policy);
    }
  }

  void call(const std::string& text = "2", std::uint32_t state = 1) {
    channel.call({square_root_uuid, text, state});
  }

  [[nodiscard]] Assignment assignment(std::uint8_t number = 1, std::uint32_t attempt = 1) const {
    return {{instance(number), attempt},
            delivery,
            std::make_shared<const std::string>(fmt::format("instance {}", number)),
            false,
            completion_signal};
  }

  [[nodiscard]] fabric::Reply reply(const std::string& text, std::uint32_t state,
                                    std::uint8_t number = 1) const {
    fabric::Reply reply;
    reply.key = {"cnc", 1};
    reply.instance = instance(number);
    reply.call = {0x5f3a, calls};
    reply.text = text;
    reply.state = state;
    for (const fabric::Request& asked : published) {
      if (asked.call == reply.call) {
        reply.asked_text = asked.text;
        reply.asked_state = asked.state;
      }
    }
    return reply;
  }
  [[nodiscard]] fabric::Reply interim(const std::string& text, std::uint32_t state,
                                      std::uint8_t number = 1) const {
    fabric::Reply interim = reply(text, state, number);
    interim.kind = fabric::ReplyKind::interim;
    return interim;
  }

  /// The program calls, and instance 1 has the call.
  void dispatched_call() {
    link_up();
    call();
    wait(std::chrono::milliseconds(20));
    assign();
  }

  // Events of the channel, each with everything that follows at once.

  void assign(std::uint8_t number = 1, std::uint32_t attempt = 1) {
    sut->change_call(now, [&](channel::OpenCall& call, channel::ChannelOutput& out) {
      call.assign(assignment(number, attempt), out, now);
    });
    settle();
  }
  void receive(const fabric::Reply& reply) {
    sut->on_reply(reply, now);
    settle();
  }
  void suspend(const fabric::Message& reason, bool blocked) {
    sut->change_call(now, [&](channel::OpenCall& call, channel::ChannelOutput& out) {
      call.suspend(reason, blocked, out, now);
    });
    settle();
  }
  /// The instance of an at-most-once call is lost.
  void blocked_call() {
    delivery = fabric::Delivery::at_most_once;
    dispatched_call();
    suspend("lost", true);
  }
  void answer(const std::string& text, std::uint32_t state, const std::string& by) {
    sut->change_call(now, [&](channel::OpenCall& call, channel::ChannelOutput& out) {
      call.answer_locally({response(text, state), by}, out, now);
    });
    settle();
  }
  void retry(const std::string& by) {
    sut->change_call(
        now, [&](channel::OpenCall& call, channel::ChannelOutput& out) { call.retry(by, out); });
    settle();
  }
  /// The journal has the first of the unconfirmed entries.
  void confirm() {
    sut->on_recorded(unconfirmed.front().ticket.number, now);
    settle();
  }
  void link_down(const std::string& reason) {
    sut->on_link_down(reason, now);
    settle();
  }

  /// Instances that have answered and whose requests are still published.
  std::vector<fabric::InstanceId> left_be() {
    std::vector<fabric::InstanceId> instances;
    for (const fabric::RequestKey& request : context->answered.take_all()) {
      instances.push_back(request.instance);
    }
    return instances;
  }

  [[nodiscard]] std::vector<fabric::EventKind> event_kinds() const {
    std::vector<fabric::EventKind> kinds;
    for (const fabric::Event& event : events) {
      kinds.push_back(event.kind);
    }
    return kinds;
  }

  tests::ServiceInterface channel;
  std::optional<channel::ChannelContext> context{std::in_place, *this, *this};
  ControllerReads controller{};
  std::optional<channel::Channel> sut{std::in_place, fabric::ChannelKey{"cnc", 1}, *this, *context,
                                      controller};
  journal::JournalState journal_state;
  Moment now;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  Policy policy;
  bool served = true;
  bool deadline_passed = false;
  bool journal_works = true;
  /// The reason why all reads fail; empty if they succeed.
  std::string unreadable;
  /// Executes no further actions.
  bool stop = false;
  std::optional<SteadyTime> wake;
  /// Called before each action, for a program that acts or a process that is killed at that point.
  std::function<void()> before_action = [] {};
  /// Decides the result of each write.
  std::function<WriteResult()> write_result = [] { return WriteResult{}; };

  /// Every write to the channel: "RESPONSE_STATE=1".
  std::vector<std::string> writes;
  std::vector<fabric::Request> published;
  std::vector<fabric::InstanceId> withdrawn;
  std::vector<fabric::CallId> declined;
  std::vector<fabric::Event> events;
  std::vector<fabric::ChannelState> states;
  std::vector<std::string> log_lines;
  std::vector<std::string> write_problems;
  std::vector<Unconfirmed> unconfirmed;
  std::uint64_t calls = 0;
  std::uint64_t offers = 0;
  std::uint64_t freed = 0;
  std::uint64_t resumed = 0;
  std::uint64_t reads = 0;

 private:
  void move_to(SteadyTime time) {
    now.wall += time - now.steady;
    now.steady = time;
    channel.advance(time);
  }

  bool interrupted() {
    before_action();
    return stop;
  }

  void follow() {
    const channel::ChannelNews news = sut->take_news();
    wake = news.wake_at ? news.wake_at : wake;
    resumed += news.resumed ? 1U : 0U;
    freed += news.ended ? 1U : 0U;
    if (news.declined) {
      declined.push_back(*news.declined);
    }
    if (news.found) {
      todo_.emplace_back([this] { found(); });
    }
  }
  void found() {
    ++offers;
    deadline_passed = sut->deadline_passed();
    if (served) {
      sut->accept({0x5f3a, ++calls}, policy, now);
    } else {
      sut->leave_unserved("no service has this UUID", policy, now);
    }
  }

  void read(const fabric::ChannelKey&, ReadSet set) override {
    todo_.emplace_back([this, set] {
      if (interrupted()) {
        return;
      }
      if (!unreadable.empty()) {
        sut->on_read_failed(unreadable, now);
        return;
      }
      ++reads;
      channel.advance(now.steady);
      sut->on_read(channel.read(set), now);
    });
  }
  void write(const fabric::ChannelKey&, const Write& write, Moment) override {
    todo_.emplace_back([this, write] { carry_out(write); });
  }
  void carry_out(const Write& write) {
    if (interrupted()) {
      return;
    }
    const WriteResult result_now = write_result();
    if (result_now.executed) {
      channel.write(write.variable, write.value);
      const auto* state = std::get_if<std::uint32_t>(&write.value);
      writes.push_back(fmt::format(
          "{}={}", name_of(write.variable).substr(12),
          state != nullptr ? std::to_string(*state) : std::get<std::string>(write.value)));
    }
    if (!interrupted()) {
      sut->on_write(result_now.outcome, "test", now);
    }
  }
  void append(const JournalEntry& entry, const Ticket& ticket) override {
    todo_.emplace_back([this, entry, ticket] {
      if (interrupted()) {
        return;
      }
      if (!journal_works) {
        unconfirmed.push_back({ticket, entry});
        return;
      }
      journal_state.apply(entry);
      if (!interrupted()) {
        sut->on_recorded(ticket.number, now);
      }
    });
  }
  void publish(const fabric::Request& request) override {
    todo_.emplace_back([this, request] { published.push_back(request); });
  }
  void publish(const fabric::Event& event) override {
    todo_.emplace_back([this, event] { events.push_back(event); });
  }
  void publish(const fabric::ChannelStatus& status) override { states.push_back(status.state); }
  void dispose(const fabric::RequestKey& request) override {
    todo_.emplace_back([this, request] { withdrawn.push_back(request.instance); });
  }
  void dispose(const fabric::ChannelKey&) override {}
  void on_over(const fabric::ChannelKey&) override {}
  void log(Level, const std::string& text) override {
    todo_.emplace_back([this, text] { log_lines.push_back(text); });
  }
  void set_alarm(const fabric::AlarmKey&, const fabric::Message& text,
                 const fabric::Message&) override {
    todo_.emplace_back([this, text] { write_problems.push_back(text); });
  }

  std::deque<std::function<void()>> todo_;
};

/// Replaces gateway, journal and channel.
inline void renew(ChannelFixture& fixture, tests::KernelRules rules = {}) {
  std::destroy_at(&fixture);
  std::construct_at(&fixture, rules);
}

}  // namespace millrace::gateway
