// A controller's message queue, a gateway's core and its journal, without sockets and threads:
// programs write, messages are called and answered, and each step can be the last one before a
// crash, or the one in which a program initialises the queue.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/control/call_control.hpp"
#include "gateway/queues/queue.hpp"

namespace millrace::gateway {

/// The ring in the controller, with the writer's rules.
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
  /// It was initialised, and nobody has looked since.
  bool unseen = false;
};

class QueuePlant : public Outputs {
 public:
  inline static const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

  explicit QueuePlant(std::uint32_t elements, queues::Drain drain = queues::Drain::journalled)
      : ring(elements) {
    settings.name = "alarms";
    settings.array = "SD.ALARMS";
    settings.control = "SD.CONTROL";
    settings.uuid = uuid;
    settings.drain = drain;
    ledger.apply(NumbersEntry{7, 1'000'000});
    start();
  }

  /// As a process that has just been started finds things.
  void start() {
    ++runs;
    todo.clear();
    const fabric::ChannelKey key = settings.key("press");
    const auto known = ledger.queues().find(key);
    queue.emplace("press", settings, known == ledger.queues().end() ? QueueBook() : known->second);
    control.emplace(*this, control::CallControlOptions{}, ledger);
    queue->on_up(now);
    control->on_link_up(key.machine, {1}, now);
    control->set_told(key, true, now);
    if (served) {
      serve();
    }
    tell_news();
  }

  void serve() {
    served = true;
    fabric::InstanceIdentity one;
    one.id.bytes.fill(static_cast<std::uint8_t>(service));
    one.uuid = uuid;
    todo.push_back([this, one] { control->on_instance_ready(one, now); });
  }

  /// One step; false if nothing is left to do now.
  bool step() {
    // The controller and the calls have their turns alternately.
    if (++steps % 2 == 0) {
      if (auto asked = queue->next(now)) {
        answer(*asked);
        tell_news();
        return true;
      }
    }
    if (!todo.empty()) {
      const auto next = std::move(todo.front());
      todo.pop_front();
      next();
      tell_news();
      return true;
    }
    if (auto asked = queue->next(now)) {
      todo.push_back([this, wanted = *asked, link = links] {
        if (link == links) {
          answer(wanted);
        }
      });
      return true;
    }
    return false;
  }

  /// Time passes, and whoever waits for it has his turn.
  void pass(std::chrono::milliseconds time) {
    now.steady += time;
    now.wall += time;
    control->on_time(now);
  }

  /// Until nothing is left to do, and once more after a look that is due; false if that takes too
  /// long.
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

  /// The controller does not answer any more; what was asked may be done there all the same.
  void cut_link(bool done) {
    if (const auto asked = queue->next(now);
        done && asked && std::holds_alternative<queues::WriteLastGet>(*asked)) {
      ring.last_get = std::get<queues::WriteLastGet>(*asked).element;
    }
    ++links;
    queue->on_down("gone");
    queue->on_up(now);
    tell_news();
  }

  /// The service is killed and started anew, without its memory; its calls go to the new one.
  void kill_service() {
    answers.clear();
    fabric::InstanceId old;
    old.bytes.fill(static_cast<std::uint8_t>(service++));
    todo.push_back([this, old] {
      control->on_instance_gone(old, now);
      serve();
    });
  }

  /// The gateway is killed: what the journal was given it keeps, all else is gone.
  void crash() { start(); }

  RingModel ring;
  queues::QueueSettings settings;
  journal::Ledger ledger;
  std::optional<queues::Queue> queue;
  std::optional<control::CallControl> control;
  Moment now{SteadyTime(std::chrono::hours(1)), fabric::Time(std::chrono::hours(1))};
  std::deque<std::function<void()>> todo;
  /// What the service has run, with the id of each call; one that it knows it answers again.
  std::vector<std::pair<fabric::CallId, std::string>> executed;
  std::map<fabric::CallId, std::string> answers;
  std::vector<std::string> lines;
  std::vector<std::string> filling;
  std::vector<std::string> troubles;
  bool served = false;
  /// Requests are lost with the service that had them.
  bool deaf = false;
  /// Answers of the controller that are lost, or refused.
  bool refuses = false;
  /// LastGet was written into a queue that was initialised since the look before: nobody can see
  /// that.
  bool unseen_at_write = false;
  int looks = 0;
  int links = 0;
  int service = 1;
  int runs = 0;
  int steps = 0;

 private:
  void answer(const queues::Step& wanted) {
    const auto refusal = tl::unexpected(std::string("cannot be read: refused"));
    if (std::holds_alternative<queues::ReadControl>(wanted)) {
      ++looks;
      ring.unseen = false;
      refuses ? queue->on_control(refusal, now) : queue->on_control(ring.control(), now);
    } else if (std::holds_alternative<queues::ReadQueue>(wanted)) {
      refuses ? queue->on_array(refusal, now) : queue->on_array(ring.texts, now);
    } else {
      if (!refuses) {
        unseen_at_write = unseen_at_write || ring.unseen;
        ring.last_get = std::get<queues::WriteLastGet>(wanted).element;
      }
      refuses ? queue->on_written(refusal, now) : queue->on_written({}, now);
    }
  }

  void tell_news() {
    const auto news = queue->take_news();
    for (const auto& entry : news.entries) {
      ledger.apply(entry);
    }
    if (news.wait) {
      todo.push_back([this] { queue->on_journalled(now); });
    }
    if (news.shows) {
      todo.push_back([this] { control->on_change(queue->key(), Variable::request_state, now); });
    }
    for (const auto& line : news.lines) {
      lines.push_back(line.text);
    }
    if (news.filling) {
      filling.push_back(*news.filling);
    }
    if (news.trouble) {
      troubles.push_back(*news.trouble);
    }
  }

  void read(const fabric::ChannelKey& key, ReadSet look) override {
    todo.emplace_back([this, key, look] {
      const Snapshot shown = queue->look(look);
      queue->on_read(look);
      control->on_read(key, shown, now);
    });
  }
  void write(const fabric::ChannelKey& key, const Write& write) override {
    queue->write(write, now);
    tell_news();
    todo.emplace_back([this, key] {
      control->on_write(key, WriteOutcome::written, "", now);
      queue->on_acknowledged();
    });
  }
  void record(const JournalEntry& entry, const Ticket& ticket) override {
    ledger.apply(entry);
    todo.emplace_back([this, ticket] { control->on_recorded(ticket, now); });
  }
  void publish(const fabric::Request& request) override {
    if (!deaf) {
      todo.emplace_back([this, request] { run(request); });
    }
  }
  void publish(const fabric::Event&) override {}
  void publish(const fabric::ChannelStatus&) override {}
  void dispose(const fabric::RequestKey&) override {}
  void dispose(const fabric::ChannelKey&) override {}
  void say(const fabric::ChannelKey&, Level, const std::string&) override {}
  void tell_write_problem(const fabric::ChannelKey&, const std::string&) override {}

  void run(const fabric::Request& request) {
    fabric::InstanceId alive;
    alive.bytes.fill(static_cast<std::uint8_t>(service));
    if (request.assigned != alive) {
      return;
    }
    if (!answers.contains(request.call)) {
      executed.emplace_back(request.call, request.text);
      answers[request.call] = request.text;
    }
    fabric::Reply reply;
    reply.key = request.key;
    reply.call = request.call;
    reply.attempt = request.attempt;
    reply.instance = request.assigned;
    reply.text = "ok";
    reply.state = 1;
    reply.asked_text = request.text;
    reply.asked_state = request.state;
    todo.push_back([this, reply] { control->on_reply(reply, now); });
  }
};

/// Of the messages that were executed, in their order.
inline std::vector<std::string> texts_of(const QueuePlant& plant) {
  std::vector<std::string> texts;
  for (const auto& [call, text] : plant.executed) {
    texts.push_back(text);
  }
  return texts;
}

/// What programs write, from `first` to `last`.
inline std::vector<std::string> numbers(int first, int last) {
  std::vector<std::string> all;
  for (int i = first; i <= last; ++i) {
    all.push_back(std::to_string(i));
  }
  return all;
}

}  // namespace millrace::gateway
