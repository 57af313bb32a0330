// The variables of a simulated controller: V.E.TIME counts milliseconds, so a value shows when it
// was read; V.E.NUMBER has the value written last.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "gateway/machines/controller.hpp"
#include "tests/simulation/time/agenda.hpp"

namespace millrace::tests::simulation {

class ValueStore {
 public:
  explicit ValueStore(Agenda& agenda) : agenda_(agenda) {}

  /// The controller's answer.
  gateway::machines::Answer answer(const gateway::machines::Question& question);
  /// The answer that a gateway assumes without one from the controller.
  static gateway::machines::Answer failure(const gateway::machines::Question& question,
                                           cnc::ads::ErrorCode code);
  /// An answer has arrived that was made at this time.
  void on_answer_arrived(Time made);
  /// The longest delay of an answer that arrived at `then` or later.
  [[nodiscard]] Time longest_way_since(Time then) const;
  [[nodiscard]] unsigned times_written(std::int32_t number) const {
    const auto found = written_.find(number);
    return found == written_.end() ? 0 : found->second;
  }

 private:
  [[nodiscard]] std::optional<std::int32_t> value_of(const std::string& name) const;

  Agenda& agenda_;
  std::int32_t number_ = 0;
  std::map<std::int32_t, unsigned> written_;
  struct Arrival {
    Time at{};
    Time way{};
  };
  /// The last answers.
  std::deque<Arrival> arrivals_;
};

}  // namespace millrace::tests::simulation
