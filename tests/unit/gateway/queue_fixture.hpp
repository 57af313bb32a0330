// A controller's message queue, a gateway's core and its journal, without sockets and threads:
// programs write, messages are called and answered. Each step can be the last one before a crash,
// or the one in which a program initialises the queue.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/core/core.hpp"
#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway {

/// The ring in the controller, with the rules for its writer.
struct RingModel {
  explicit RingModel(std::uint32_t elements) : texts(elements) {}

  void initialise() {
    last_filled = last_get = 1;
    unseen = true;
  }
  [[nodiscard]] std::uint32_t next() const {
    return last_filled % static_cast<std::uint32_t>(texts.size()) + 1;
  }
  [[nodiscard]] bool full() const { return next() == last_get; }
  /// False: the program is aborted.
  bool write(const std::string& text) {
    if (full()) {
      return false;
    }
    texts[next() - 1] = text;
    last_filled = next();
    return true;
  }
  [[nodiscard]] queues::Control control() const {
    return {last_filled, last_get, static_cast<std::uint32_t>(texts.size())};
  }

  std::vector<std::string> texts;
  std::uint32_t last_filled = 1;
  std::uint32_t last_get = 1;
  /// It was initialised and not read since.
  bool unseen = false;
};

class QueueFixture : public core::RecordedPorts {
 public:
  inline static const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

  explicit QueueFixture(std::uint32_t elements,
                        queues::Acknowledge acknowledge = queues::Acknowledge::when_journalled)
      : ring(elements) {
    settings.name = "alarms";
    settings.array = "SD.ALARMS";
    settings.control = "SD.CONTROL";
    settings.uuid = uuid;
    settings.acknowledge = acknowledge;
    key = settings.key("press");
    journal_state.apply(NumbersEntry{7, 1'000'000});
    start();
  }

  /// Starts a new process with the present state of the rest.
  void start() {
    todo.clear();
    settings::MachineSettings machine;
    machine.name = "press";
    machine.watch = SubscriptionMode::poll;
    machine.queues = {settings};
    core = std::make_unique<core::Core>(
        *this, *this,
        core::CoreOptions{.own = {gateway_id(5), "host1", 4711, "1", 7},
                          .lease = std::chrono::seconds(2),
                          .machines = {machine}},
        journal_state);
    linked = false;
    core->start();
    while (!linked) {
      pass(*wakes_at - time.steady);
    }
    core->on_link_up("press", {1});
    if (served) {
      serve();
    }
  }

  void serve() {
    served = true;
    fabric::InstanceIdentity identity;
    identity.id = gateway_id(service);
    identity.uuid = uuid;
    todo.push_back([this, identity] { core->on_instance_ready(identity); });
  }

  /// One step; false if there is nothing to do now.
  bool step() {
    if (todo.empty()) {
      return false;
    }
    const auto next = std::move(todo.front());
    todo.pop_front();
    next();
    return true;
  }

  /// Lets time pass and runs the timers that are due.
  void pass(std::chrono::nanoseconds passed) {
    time.steady += passed;
    time.wall += passed;
    if (wakes_at && *wakes_at <= time.steady) {
      wakes_at.reset();
      core->on_time();
    }
  }

  /// Continues until there is nothing to do, and once more after a read that is due; false if that
  /// takes too long.
  bool settle() {
    for (int round = 0; round < 6; ++round) {
      for (int i = 0; step(); ++i) {
        if (i > 100'000) {
          return false;
        }
      }
      pass(std::chrono::milliseconds(300));
    }
    return true;
  }

  /// The controller notifies a change of the queue.
  void tell() { core->on_queue_event(key); }
  void switch_controller_off() { core->on_link_down("press", {"switched off"}); }

  /// Kills and restarts the service, without its memory; its calls go to the new instance.
  void kill_service() {
    answers.clear();
    todo.push_back([this, old = gateway_id(service++)] {
      core->on_instance_gone(old);
      serve();
    });
  }

  /// Kills the gateway: the journal keeps its entries, everything else is lost.
  void crash() { start(); }

  /// The unanswered messages in the journal.
  [[nodiscard]] std::uint64_t waiting() const { return journal_state.queues().at(key).waiting(); }

  RingModel ring;
  queues::QueueSettings settings;
  fabric::ChannelKey key;
  journal::JournalState journal_state;
  std::unique_ptr<core::Core> core;
  std::deque<std::function<void()>> todo;
  /// The requests that the service has run, with the ids of their calls; for a known id it repeats
  /// its answer.
  std::vector<std::pair<fabric::CallId, std::string>> executed;
  std::map<fabric::CallId, std::string> answers;
  using RecordedPorts::log_lines;
  std::vector<std::string> filling;
  std::vector<std::string> troubles;
  bool served = false;
  /// The gateway has begun to connect.
  bool linked = false;
  /// The controller refuses all requests.
  bool refuses = false;
  /// LastGet was written into a queue that was initialised since the previous read, which no
  /// gateway can detect.
  bool unseen_at_write = false;
  int looks = 0;
  std::uint8_t service = 1;

 private:
  class RingLink final : public SilentLink {
   public:
    explicit RingLink(QueueFixture& plant) : plant_(plant) {}
    using SilentLink::ask;
    void ask(const fabric::ChannelKey&, const queues::Step& step) override {
      plant_.todo.emplace_back([&plant = plant_, step] {
        plant.core->on_queue_answer(plant.key, plant.answer_to(step));
      });
    }

   private:
    QueueFixture& plant_;
  };

  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings&) override {
    linked = true;
    return std::make_unique<RingLink>(*this);
  }

  queues::StepAnswer answer_to(const queues::Step& wanted) {
    const auto refusal = tl::unexpected(std::string("cannot be read: refused"));
    if (std::holds_alternative<queues::ReadControl>(wanted)) {
      ++looks;
      ring.unseen = false;
      return refuses ? queues::Answer<queues::Control>(refusal) : ring.control();
    }
    if (std::holds_alternative<queues::ReadQueue>(wanted)) {
      return refuses ? queues::Answer<std::vector<std::string>>(refusal) : ring.texts;
    }
    if (refuses) {
      return queues::Answer<void>(refusal);
    }
    unseen_at_write = unseen_at_write || ring.unseen;
    ring.last_get = std::get<queues::WriteLastGet>(wanted).element;
    return queues::Answer<void>();
  }

  using RecordedPorts::publish;
  void publish(const fabric::Request& request) override {
    todo.emplace_back([this, request] { run(request); });
  }
  void append(const JournalEntry& entry, const Ticket& ticket) override {
    journal_state.apply(entry);
    if (ticket) {
      todo.emplace_back([this, ticket] { core->on_recorded(ticket); });
    }
  }
  void set_alarm(const fabric::AlarmKey& about, const fabric::Message& text,
                 const fabric::Message&) override {
    if (about.kind == "queue") {
      troubles.push_back(text);
    } else if (about.kind == "queue_filling") {
      filling.push_back(text);
    }
  }

  void run(const fabric::Request& request) {
    if (request.assigned != gateway_id(service)) {
      return;
    }
    if (!answers.contains(request.call)) {
      executed.emplace_back(request.call, request.text);
      answers[request.call] = request.text;
    }
    todo.push_back([this, reply = reply_to(request, "ok", 1)] { core->on_reply(reply); });
  }
};

/// The texts of the executed messages, in their order.
inline std::vector<std::string> texts_of(const QueueFixture& plant) {
  std::vector<std::string> texts;
  for (const auto& [call, text] : plant.executed) {
    texts.push_back(text);
  }
  return texts;
}

/// The texts of the messages from `first` to `last`.
inline std::vector<std::string> numbers(int first, int last) {
  std::vector<std::string> all;
  for (int i = first; i <= last; ++i) {
    all.push_back(std::to_string(i));
  }
  return all;
}

/// Runs `happen` once, after `at` steps of a run in which messages are written as far as there is
/// room.
template <typename Happen>
void run_with(QueueFixture& plant, int at, int messages, Happen happen) {
  plant.serve();
  int written = 0;
  int looked = -1;
  bool happened = false;
  for (int i = 0; !happened || written < messages; ++i) {
    ASSERT_LT(i, 20'000);
    if (!happened && i == at) {
      happened = true;
      happen(written);
    }
    // A program that initialises the queue and refills it to the same position between two reads
    // cannot be detected.
    const bool may_write = i % 3 == 0 && written < messages && (!happened || plant.looks > looked);
    if (may_write && plant.ring.write(std::to_string(written + 1))) {
      ++written;
      looked = plant.looks;
    }
    if (!plant.step()) {
      plant.pass(std::chrono::milliseconds(20));
    }
  }
  ASSERT_TRUE(plant.settle());
  ASSERT_EQ(written, messages);
}

}  // namespace millrace::gateway
