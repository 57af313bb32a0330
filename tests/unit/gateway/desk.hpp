// One channel session at work on a Service Interface, for tests: carries out its actions at once,
// and remembers what it saw.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "gateway/channel/session.hpp"
#include "gateway/journal/ledger.hpp"
#include "tests/support/service_interface.hpp"

namespace millrace::gateway {

inline const std::string square_root_uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47";

inline fabric::InstanceId instance(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

/// An answer that can be written.
inline Response response(const std::string& text, std::uint32_t state) {
  return Response::of(text, state).value();
}

/// What becomes of one write.
struct Fate {
  WriteOutcome outcome = WriteOutcome::written;
  bool executed = true;
};

class Desk {
 public:
  explicit Desk(tests::KernelRules rules = {}) : channel(rules) {
    ledger.apply(NumbersEntry{0x5f3a, 0});
    now.wall = fabric::Time(std::chrono::hours(24 * 365 * 50));
    now.steady = SteadyTime(std::chrono::hours(1));
    channel.advance(now.steady);
  }

  /// Carries out all that can be done without waiting.
  void feed(const SessionActions& actions) {
    for (const SessionAction& action : actions) {
      todo_.push_back(action);
    }
    while (!todo_.empty() && !stop) {
      const SessionAction action = todo_.front();
      todo_.pop_front();
      std::visit([this](const auto& one) { carry_out(one); }, action);
    }
  }

  void link_up() { feed(sut->on_link_up(now)); }

  /// Lets time pass, waking the session whenever it asked for it.
  void wait(std::chrono::milliseconds time) {
    const SteadyTime end = now.steady + time;
    while (!stop && wake && *wake <= end) {
      move_to(*std::exchange(wake, std::nullopt));
      feed(sut->on_wake(now));
    }
    if (!stop) {
      move_to(end);
    }
  }

  /// The gateway's process dies and starts again; only journal and channel survive.
  void restart() {
    todo_.clear();
    wake.reset();
    stop = false;
    sut.emplace(fabric::ChannelKey{"cnc", 1});
    for (const Call& call : ledger.open_calls()) {
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
            awaited};
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
    fabric::Reply one = reply(text, state, number);
    one.kind = fabric::ReplyKind::interim;
    return one;
  }

  /// The program calls, and instance 1 has the call.
  void dispatched_call() {
    link_up();
    call();
    wait(std::chrono::milliseconds(20));
    feed(sut->assign(assignment(), now));
  }

  [[nodiscard]] std::vector<fabric::EventKind> event_kinds() const {
    std::vector<fabric::EventKind> kinds;
    for (const fabric::Event& event : events) {
      kinds.push_back(event.kind);
    }
    return kinds;
  }

  tests::ServiceInterface channel;
  std::optional<channel::ChannelSession> sut{std::in_place, fabric::ChannelKey{"cnc", 1}};
  journal::Ledger ledger;
  Moment now;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  fabric::Awaited awaited = fabric::Awaited::response_state;
  Policy policy;
  bool served = true;
  bool out_of_patience = false;
  bool journal_works = true;
  /// Nothing is carried out any more.
  bool stop = false;
  std::optional<SteadyTime> wake;
  /// Called before each action, in its place: a program that acts, a process that dies.
  std::function<void()> before_action = [] {};
  /// Decides what becomes of each write.
  std::function<Fate()> fate = [] { return Fate{}; };

  /// "RESPONSE_STATE=1": every write the channel has seen.
  std::vector<std::string> writes;
  std::vector<fabric::Request> published;
  std::vector<fabric::InstanceId> withdrawn;
  std::vector<fabric::InstanceId> left_be;
  std::vector<fabric::CallId> declined;
  std::vector<fabric::Event> events;
  std::vector<std::string> said;
  std::vector<std::string> write_problems;
  std::vector<Record> unconfirmed;
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

  void carry_out(const Action& action) {
    std::visit([this](const auto& one) { carry_out(one); }, action);
  }
  void carry_out(const Read& one) {
    if (!interrupted()) {
      ++reads;
      channel.advance(now.steady);
      append(sut->on_read(channel.read(one.look), now));
    }
  }
  void carry_out(const Write& one) {
    if (interrupted()) {
      return;
    }
    const Fate fate_now = fate();
    if (fate_now.executed) {
      channel.write(one.variable, one.value);
      const auto* state = std::get_if<std::uint32_t>(&one.value);
      writes.push_back(fmt::format(
          "{}={}", name_of(one.variable).substr(12),
          state != nullptr ? std::to_string(*state) : std::get<std::string>(one.value)));
    }
    if (!interrupted()) {
      append(sut->on_write(fate_now.outcome, "test", now));
    }
  }
  void carry_out(const WakeAt& one) { wake = one.at; }
  void carry_out(const Offer& one) {
    ++offers;
    out_of_patience = one.out_of_patience;
    if (served) {
      append(sut->claim({0x5f3a, ++calls}, policy, now));
    } else {
      append(sut->leave("served by nobody", policy, now));
    }
  }
  void carry_out(const Record& one) {
    if (interrupted()) {
      return;
    }
    if (!journal_works) {
      unconfirmed.push_back(one);
      return;
    }
    ledger.apply(one.entry);
    if (!interrupted()) {
      append(sut->on_recorded(one.ticket.number, now));
    }
  }
  void carry_out(const Publish& one) { published.push_back(one.request); }
  void carry_out(const Withdraw& one) { withdrawn.push_back(one.instance); }
  void carry_out(const LeaveBe& one) { left_be.push_back(one.instance); }
  void carry_out(const Resume&) { ++resumed; }
  void carry_out(const Freed&) { ++freed; }
  void carry_out(const Declined& one) { declined.push_back(one.call); }
  void carry_out(const Tell& one) { events.push_back(one.event); }
  void carry_out(const Show&) {}
  void carry_out(const Hide&) {}
  void carry_out(const Say& one) { said.push_back(one.text); }
  void carry_out(const WriteProblem& one) { write_problems.push_back(one.text); }

  void append(const SessionActions& actions) {
    todo_.insert(todo_.end(), actions.begin(), actions.end());
  }

  std::deque<SessionAction> todo_;
};

}  // namespace millrace::gateway
