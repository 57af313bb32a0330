// Plays a plan: issues each call at its time, stops calls that take too long, counts the rounds.
//
//   Player player(executor, plan, {.pace = {.rate = 2}}, stage);
//   player.start();                          // stage.issue(0) …
//   player.ended(0, answer, "");             // stage.on_outcome({.call = 0, …}) …, stage.on_done()
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "tools/replay/comparison.hpp"
#include "tools/replay/scheduler.hpp"

namespace millrace::tools::replay {

/// Receives the calls. Called on the executor, one at a time.
class Stage {
 public:
  virtual ~Stage() = default;
  /// Makes this call; the stage reports its end with Player::ended.
  virtual void issue(std::size_t call) = 0;
  /// Withdraws the call if it is still pending; its end is reported as well.
  virtual void withdraw(std::size_t call, const fabric::Message& reason) = 0;
  virtual void on_outcome(const Outcome& outcome) = 0;
  /// All calls of all rounds are over; after stop(), all calls that were issued.
  virtual void on_done() = 0;
};

struct PlayOptions {
  Pace pace{};
  /// 0 = without end.
  std::size_t rounds = 1;
  /// Longest time for a call that was answered in the recording.
  nanoseconds patience = std::chrono::seconds(30);
};

/// Not thread-safe; lives on the executor, which runs one handler at a time. Must not be destroyed
/// from within a function of the stage.
class Player {
 public:
  /// `plan` (not empty) and `stage` outlive the player.
  Player(boost::asio::any_io_executor executor, const Plan& plan, PlayOptions options,
         Stage& stage);
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  void start();
  /// An issued call is over, with a response or with the reason why there is none.
  void ended(std::size_t call, std::optional<Answer> answer, const std::string& reason);
  /// Issues no further call and withdraws the open ones.
  void stop(const std::string& reason);

  /// For Timing::step: the call that waits for allow().
  [[nodiscard]] std::optional<std::size_t> upcoming() const;
  void allow();

  [[nodiscard]] std::size_t round() const { return round_; }
  /// Calls of all rounds so far.
  [[nodiscard]] std::size_t finished() const { return finished_; }

 private:
  using Clock = std::chrono::steady_clock;

  struct Open {
    Clock::time_point issued{};
    nanoseconds late{};
    bool held_up = false;
    Clock::time_point until{};
    /// Withdrawn; its end has not been reported yet.
    bool withdrawn = false;
  };

  void begin_round();
  void pump();
  void schedule_step();
  void issue(std::size_t call, Clock::time_point now);
  void withdraw_overdue(Clock::time_point now);
  void set_timer();

  boost::asio::any_io_executor executor_;
  boost::asio::steady_timer timer_;
  const Plan& plan_;
  PlayOptions options_;
  Stage& stage_;
  std::optional<Scheduler> scheduler_;
  std::map<std::size_t, Open> open_;
  Clock::time_point start_{};
  std::size_t round_ = 0;
  std::size_t finished_ = 0;
  bool pumping_ = false;
  bool stopped_ = false;
  bool done_ = false;
  /// Makes handlers that run after the player's end do nothing.
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace millrace::tools::replay
