// A process with an end on the fabric: the common part of gateways and services.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "tests/simulation/fabric/fabric.hpp"

namespace millrace::tests::simulation {

class Member {
 public:
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;

  /// Like SIGSTOP and SIGCONT.
  void freeze();
  void thaw();
  /// The clock of its host is set.
  void step_clock(Time by) { clock_error_ += by; }

  [[nodiscard]] bool running() const { return process_.running(); }
  [[nodiscard]] bool frozen() const { return process_.frozen(); }
  [[nodiscard]] std::optional<EndNumber> end() const { return end_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 protected:
  Member(std::string name, Agenda& agenda, Party party, History& history, Fabric& fabric)
      : name_(std::move(name)), history_(history), fabric_(fabric), process_(agenda, party) {}
  ~Member() = default;

  [[nodiscard]] Process& process() { return process_; }
  [[nodiscard]] const Process& process() const { return process_; }
  [[nodiscard]] History& history() const { return history_; }
  [[nodiscard]] Fabric& fabric() { return fabric_; }
  [[nodiscard]] const Fabric& fabric() const { return fabric_; }
  [[nodiscard]] Time now() const { return process_.agenda().now(); }
  /// The time of its wall clock.
  [[nodiscard]] fabric::Time wall() const;
  void note(const std::string& what) { history_.note(name_, what); }
  void joined(EndNumber end) { end_ = end; }
  /// `in_order`: it sends a farewell to the others.
  void leave(bool in_order) { fabric_.leave(*std::exchange(end_, {}), in_order); }

 private:
  std::string name_;
  History& history_;
  Fabric& fabric_;
  Process process_;
  std::optional<EndNumber> end_;
  Time clock_error_{};
  Time frozen_at_{};
};

}  // namespace millrace::tests::simulation
