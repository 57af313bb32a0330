// A process of the simulation: it can be killed, and frozen as by SIGSTOP. Events for a killed
// process are lost; those for a frozen one wait until it continues.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "tests/simulation/time/agenda.hpp"

namespace millrace::tests::simulation {

class Process {
 public:
  /// The outbox of a party has its bit shifted by this.
  static constexpr unsigned outboxes = 32;
  /// Its inbox has it shifted by this.
  static constexpr unsigned inboxes = 16;

  Process(Agenda& agenda, Party party) : agenda_(agenda), party_(party) {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] bool frozen() const { return frozen_; }
  /// It runs and is not frozen.
  [[nodiscard]] bool awake() const { return running_ && !frozen_; }
  [[nodiscard]] std::uint64_t parties() const { return std::uint64_t{1} << party_; }
  /// What it has published on the fabric, as a party of its own: others fetch it without its
  /// action.
  [[nodiscard]] std::uint64_t outbox() const { return parties() << outboxes; }
  /// What has arrived from the fabric and is not taken yet, as a party of its own: it arrives
  /// without the process's action.
  [[nodiscard]] std::uint64_t inbox() const { return parties() << inboxes; }
  [[nodiscard]] Agenda& agenda() const { return agenda_; }

  void start() { running_ = true; }
  void end() {
    running_ = false;
    frozen_ = false;
    pause_ = {};
    ++life_;
    held_.clear();
  }
  void freeze() {
    frozen_ = true;
    frozen_at_ = agenda_.now();
  }
  void thaw() {
    frozen_ = false;
    thawed_at_ = agenda_.now();
    pause_ = thawed_at_ - frozen_at_;
    for (auto& act : std::exchange(held_, {})) {
      after(Time{}, std::move(act));
    }
  }

  /// Runs `act` only in this run of the process. Events on one lane keep their order.
  void after(Time delay, std::function<void()> act, std::uint32_t lane = 0) {
    plan(delay, {.parties = parties(), .lane = lane}, std::move(act));
  }
  /// The same for an event that reads other parties.
  void after_reading(std::uint64_t reads, Time delay, std::function<void()> act) {
    plan(delay, {.parties = parties(), .reads = reads}, std::move(act));
  }
  /// The same for a timer.
  void timer(Time delay, std::function<void()> act) {
    plan(delay, {.parties = parties(), .timer = true}, std::move(act));
  }

  /// The length of its last pause, if that ended within this time.
  [[nodiscard]] Time stood_still(Time within) const {
    return agenda_.now() - thawed_at_ <= within ? pause_ : Time{};
  }

  /// Counts the runs.
  [[nodiscard]] const std::uint64_t& life() const { return life_; }
  /// Within an event: now, or when it continues.
  void run(std::uint64_t life, std::function<void()> act) {
    if (!running_ || life != life_) {
      return;
    }
    if (frozen_) {
      held_.push_back(std::move(act));
    } else {
      act();
    }
  }

 private:
  void plan(Time delay, Plan plan, std::function<void()> act) {
    plan.lives.first = &life_;
    agenda_.after(delay, plan, [this, life = life_, act = std::move(act)]() mutable {
      run(life, std::move(act));
    });
  }

  Agenda& agenda_;
  Party party_;
  bool running_ = false;
  bool frozen_ = false;
  Time frozen_at_{};
  /// The last one of this run.
  Time pause_{};
  Time thawed_at_{};
  std::uint64_t life_ = 0;
  std::vector<std::function<void()>> held_;
};

}  // namespace millrace::tests::simulation
