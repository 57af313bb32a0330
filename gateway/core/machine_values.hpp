// The requests to one controller besides calls: sampled data, states of NC programs, and requested
// variables. Decides what is requested when, and publishes the results; calls have priority. Pure.
//
//   MachineValues values("press", fabric, host, own);
//   values.set(settings, now);                        // again when the configuration changes
//   values.on_up({1, 2}, now);
//   values.on_request(request, now);
//   if (values.is_due(now)) values.pump(link, rests_since, now);    → link.ask(question)
//   values.on_answer(answer, now);
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "gateway/core/ports.hpp"
#include "gateway/data/sampler.hpp"
#include "gateway/programs/program_watch.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace millrace::gateway::core {

class MachineValues {
 public:
  /// Both ports must outlive this. `own` is this gateway.
  MachineValues(std::string machine, Fabric& fabric, Host& host, const fabric::InstanceId& own);

  void set(const settings::MachineSettings& settings, Moment now);
  /// The link is up and these of its channels are served; also when there are more.
  void on_up(const machines::Channels& channels, Moment now);
  /// The pending request gets no response any more.
  void on_down(const fabric::Message& reason, Moment now);
  /// The link was taken away: no channel is ours any more.
  void on_dropped(Moment now);
  /// The channel is not ours any more.
  void on_over(std::uint16_t channel, Moment now);
  /// Left to another gateway if the channel is not ours.
  void on_request(const fabric::VariableRequest& request, Moment now);
  void on_answer(const machines::Answer& answer, Moment now);

  /// Publishes results and sends the requests that are due over `link`, if there is one.
  /// `rests_since`: since when no request of a call is under way; nullopt while one is.
  void pump(machines::Controller* link, std::optional<SteadyTime> rests_since, Moment now);
  /// pump() has work.
  [[nodiscard]] bool is_due(Moment now) const {
    return due_.now || due_.gives_way || (due_.at && *due_.at <= now.steady);
  }
  /// A question waits until no call is under way: the next event may be the time for it.
  [[nodiscard]] bool gives_way() const { return due_.gives_way; }
  /// When it has work if nothing else happens.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return due_.at; }

 private:
  /// Of data or of variables.
  struct Turn {
    /// The pending request; 0 = none.
    std::uint64_t asked = 0;
    /// Something is to be asked since then.
    std::optional<SteadyTime> wanted_since{};
  };
  /// How long a request waits after the last request of a call, and for a link that is always busy.
  struct Patience {
    std::chrono::microseconds rest;
    std::chrono::milliseconds longest;
  };

  /// Of what is sampled, if there is anything.
  struct Sampling {
    data::Sampler sampler;
    std::map<std::uint16_t, programs::ProgramWatch> programs{};
    Turn turn{};
  };
  /// Of a link that was never up the channels are unknown.
  enum class LinkState : std::uint8_t { none, up, down };
  /// When pump() has work.
  struct Due {
    bool now = false;
    /// A question waits for calls.
    bool gives_way = false;
    std::optional<SteadyTime> at{};
  };

  void begin(Moment now);
  void stop_asking(LinkState state);
  /// When the question may be asked: now, or later.
  SteadyTime time_for(Turn& turn, const Patience& patience, std::optional<SteadyTime> rests_since,
                      Moment now);
  void ask(machines::Controller& link, Turn& turn, machines::Requester requester,
           variables::Step step);
  void wake_at(std::optional<SteadyTime> time) { due_.at = earliest({due_.at, time}); }
  void ask_variables(machines::Controller& link, std::optional<SteadyTime> rests_since, Moment now);
  void ask_data(machines::Controller& link, std::optional<SteadyTime> rests_since, Moment now);
  void publish_output(Moment now);
  void publish(const fabric::DataSample& sample);

  std::string machine_;
  Fabric& fabric_;
  Host& host_;
  fabric::InstanceId own_;
  settings::MachineSettings settings_;
  std::optional<Sampling> sampling_;
  variables::VariableRequests variables_;
  Turn variables_turn_;
  std::uint64_t last_question_ = 0;
  LinkState link_state_ = LinkState::none;
  /// Those that are ours, also while the link is down.
  std::set<std::uint16_t> channels_;
  Due due_;
};

}  // namespace millrace::gateway::core
