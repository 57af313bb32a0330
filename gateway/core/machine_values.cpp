#include "gateway/core/machine_values.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::core {

namespace {

using namespace std::chrono_literals;

bool is_of_program(const fabric::DataSample& sample) {
  return sample.group == programs::programs_group;
}

}  // namespace

MachineValues::MachineValues(std::string machine, Fabric& fabric, Host& host,
                             const fabric::InstanceId& own)
    : machine_(std::move(machine)),
      fabric_(fabric),
      host_(host),
      own_(own),
      variables_(machine_, {}) {}

void MachineValues::set(const settings::MachineSettings& settings, Moment now) {
  const bool same = settings_.data == settings.data && settings_.programs == settings.programs;
  settings_ = settings;
  variables_.change(settings_.variables);
  if (!same) {
    begin(now);
  }
}

void MachineValues::begin(Moment now) {
  if (sampling_) {
    sampling_->sampler.on_over(0, now);
    publish_output(now);
    sampling_.reset();
  }
  data::DataSettings all = settings_.data;
  for (const programs::ProgramSettings& program : settings_.programs) {
    all.groups.push_back(programs::group_of(program));
  }
  if (!all.groups.empty()) {
    sampling_.emplace(Sampling{.sampler = data::Sampler(machine_, all)});
    for (const programs::ProgramSettings& program : settings_.programs) {
      sampling_->programs.try_emplace(program.channel,
                                      fabric::ChannelKey{machine_, program.channel}, program);
    }
    if (link_state_ == LinkState::up) {
      sampling_->sampler.on_up({channels_.begin(), channels_.end()}, now.steady);
    }
  }
  due_.now = true;
}

void MachineValues::on_up(const machines::Channels& channels, Moment now) {
  link_state_ = LinkState::up;
  channels_.insert(channels.begin(), channels.end());
  if (sampling_) {
    sampling_->sampler.on_up(channels, now.steady);
  }
  variables_.on_up(channels, now);
  due_.now = true;
}

void MachineValues::stop_asking(LinkState state) {
  if (sampling_) {
    sampling_->turn = {};
  }
  variables_turn_ = {};
  link_state_ = state;
  due_.gives_way = false;
  due_.now = true;
}

void MachineValues::on_down(const fabric::Message& reason, Moment now) {
  stop_asking(LinkState::down);
  if (sampling_) {
    // The machine's status has the reason for all its values.
    sampling_->sampler.on_down(base::messages::link_is_down(), now);
  }
  variables_.on_down(reason, now);
}

void MachineValues::on_dropped(Moment now) {
  stop_asking(LinkState::none);
  channels_.clear();
  if (sampling_) {
    sampling_->sampler.on_over(0, now);
  }
  variables_.on_over(0, now);
}

void MachineValues::on_over(std::uint16_t channel, Moment now) {
  channels_.erase(channel);
  if (sampling_) {
    sampling_->sampler.on_over(channel, now);
  }
  variables_.on_over(channel, now);
  due_.now = true;
}

void MachineValues::on_request(const fabric::VariableRequest& request, Moment now) {
  // Which channels a controller has that never answered is not known.
  const bool never_up = link_state_ == LinkState::down && channels_.empty();
  if (never_up || channels_.contains(request.key.channel)) {
    variables_.on_request(request, now);
    due_.now = true;
  }
}

void MachineValues::on_answer(const machines::Answer& answer, Moment now) {
  const bool of_data = answer.requester == machines::Requester::data;
  Turn* const turn = !of_data ? &variables_turn_ : sampling_ ? &sampling_->turn : nullptr;
  if (turn == nullptr || turn->asked == 0 || answer.number != turn->asked) {
    return;
  }
  turn->asked = 0;
  due_.now = true;
  if (of_data) {
    std::visit(fabric::Cases{[&](const std::vector<data::Sampler::Resolved>& known) {
                               sampling_->sampler.on_resolved(known, answer.requests, now);
                             },
                             [&](const std::vector<data::Sampler::Answer>& values) {
                               sampling_->sampler.on_read(values, answer.requests, answer.sums,
                                                          now);
                             },
                             [](const auto&) {}},
               answer.found);
    return;
  }
  std::visit(fabric::Cases{[&](const std::vector<data::Sampler::Resolved>& known) {
                             variables_.on_resolved(known, answer.requests, now);
                           },
                           [&](const std::vector<data::Sampler::Answer>& values) {
                             variables_.on_read(values, answer.requests, answer.sums, now);
                           },
                           [&](const cnc::ads::Result<void>& written) {
                             variables_.on_written(written, answer.requests, now);
                           },
                           [&](const cnc::ads::Result<variables::Page>& page) {
                             variables_.on_listed(page, answer.requests, now);
                           }},
             answer.found);
}

SteadyTime MachineValues::time_for(Turn& turn, const Patience& patience,
                                   std::optional<SteadyTime> rests_since, Moment now) {
  if (!turn.wanted_since) {
    turn.wanted_since = now.steady;
  }
  const SteadyTime latest = *turn.wanted_since + patience.longest;
  const SteadyTime at = rests_since ? std::min(*rests_since + patience.rest, latest) : latest;
  if (at > now.steady) {
    due_.gives_way = true;
    wake_at(at);
  }
  return at;
}

void MachineValues::ask(machines::Controller& link, Turn& turn, machines::Requester requester,
                        variables::Step step) {
  turn = {.asked = ++last_question_};
  link.ask({requester, turn.asked, std::move(step)});
}

void MachineValues::ask_variables(machines::Controller& link, std::optional<SteadyTime> rests_since,
                                  Moment now) {
  constexpr Patience patience{.rest = 250us, .longest = 25ms};
  const auto due = variables_.next_time(now.steady);
  if (!due || *due > now.steady || variables_turn_.asked != 0) {
    wake_at(due);
    return;
  }
  if (time_for(variables_turn_, patience, rests_since, now) > now.steady) {
    return;
  }
  variables_turn_ = {};
  if (auto step = variables_.next(now)) {
    ask(link, variables_turn_, machines::Requester::variables, *std::move(step));
  }
  if (const auto next = variables_.next_time(now.steady)) {
    wake_at(std::max(*next, now.steady + patience.rest));
  }
}

void MachineValues::ask_data(machines::Controller& link, std::optional<SteadyTime> rests_since,
                             Moment now) {
  constexpr Patience patience{.rest = 1ms, .longest = 50ms};
  const auto due = sampling_ ? sampling_->sampler.next_time(now.steady) : std::nullopt;
  if (!due || *due > now.steady) {
    wake_at(due);
    return;
  }
  if (time_for(sampling_->turn, patience, rests_since, now) > now.steady) {
    return;
  }
  sampling_->turn = {};
  if (auto step = sampling_->sampler.next(now)) {
    ask(link, sampling_->turn, machines::Requester::data,
        std::visit([](auto&& sampled)
                       -> variables::Step { return std::forward<decltype(sampled)>(sampled); },
                   *std::move(step)));
  } else if (const auto next = sampling_->sampler.next_time(now.steady)) {
    wake_at(std::max(*next, now.steady + patience.rest));
  }
}

void MachineValues::pump(machines::Controller* link, std::optional<SteadyTime> rests_since,
                         Moment now) {
  due_ = {.now = due_.now};
  variables_.on_time(now);
  if (link_state_ == LinkState::up && link != nullptr) {
    // Before replies are sent: the controller's response takes longest.
    ask_variables(*link, rests_since, now);
    ask_data(*link, rests_since, now);
  } else {
    wake_at(variables_.next_time(now.steady));
  }
  publish_output(now);
}

void MachineValues::publish_output(Moment now) {
  due_.now = false;
  if (sampling_) {
    const data::Output output = sampling_->sampler.take_output();
    for (const fabric::DataSample& sample : output.samples) {
      publish(sample);
    }
    for (const fabric::DataSample& sample : output.left) {
      if (!is_of_program(sample)) {
        fabric_.dispose(sample);
      }
    }
    for (const auto& line : output.lines) {
      host_.log(line.level, line.text);
    }
  }
  const variables::Output output = variables_.take_output();
  for (const auto& answer : output.answers) {
    fabric_.publish(answer.requester, answer.reply);
  }
  for (const auto& written : output.written) {
    fabric_.publish(fabric::Outcome{own_, written.token, written.done, written.detail, now.wall});
  }
  for (const auto& line : output.lines) {
    host_.log(line.level, line.text);
  }
}

void MachineValues::publish(const fabric::DataSample& sample) {
  if (!is_of_program(sample)) {
    fabric_.publish(sample);
    return;
  }
  const auto program = sampling_->programs.find(sample.key.channel);
  if (program == sampling_->programs.end()) {
    return;
  }
  for (const fabric::ProgramEvent& event : program->second.on_sample(sample)) {
    host_.log(Level::info,
              fmt::format("{}: program {}{}{}", event.key.to_string(),
                          printable(event.program) + (event.program.empty() ? "" : " "),
                          fabric::name_of(event.kind),
                          event.error == 0 ? "" : fmt::format(" by error {}", event.error)));
    fabric_.publish(event);
  }
}

}  // namespace millrace::gateway::core
