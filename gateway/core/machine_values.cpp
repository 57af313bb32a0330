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
  if (sampler_) {
    sampler_->on_over(0, now);
    publish_output(now);
    sampler_.reset();
    data_turn_ = {};
  }
  programs_.clear();
  data::DataSettings all = settings_.data;
  for (const programs::ProgramSettings& program : settings_.programs) {
    programs_.try_emplace(program.channel, fabric::ChannelKey{machine_, program.channel}, program);
    all.groups.push_back(programs::group_of(program));
  }
  if (!all.groups.empty()) {
    sampler_.emplace(machine_, all);
    if (up_) {
      sampler_->on_up({channels_.begin(), channels_.end()}, now.steady);
    }
  }
  changed_ = true;
}

void MachineValues::on_up(const machines::Channels& channels, Moment now) {
  up_ = true;
  down_ = false;
  channels_.insert(channels.begin(), channels.end());
  if (sampler_) {
    sampler_->on_up(channels, now.steady);
  }
  variables_.on_up(channels, now);
  changed_ = true;
}

void MachineValues::stop_asking() {
  data_turn_ = {};
  variables_turn_ = {};
  gives_way_ = false;
  up_ = false;
  changed_ = true;
}

void MachineValues::on_down(const fabric::Message& reason, Moment now) {
  stop_asking();
  down_ = true;
  if (sampler_) {
    // The machine's status has the reason for all its values.
    sampler_->on_down(base::messages::link_is_down(), now);
  }
  variables_.on_down(reason, now);
}

void MachineValues::on_dropped(Moment now) {
  stop_asking();
  down_ = false;
  channels_.clear();
  if (sampler_) {
    sampler_->on_over(0, now);
  }
  variables_.on_over(0, now);
}

void MachineValues::on_over(std::uint16_t channel, Moment now) {
  channels_.erase(channel);
  if (sampler_) {
    sampler_->on_over(channel, now);
  }
  variables_.on_over(channel, now);
  changed_ = true;
}

void MachineValues::on_request(const fabric::VariableRequest& request, Moment now) {
  // Which channels a controller has that never answered is not known.
  const bool never_up = down_ && channels_.empty();
  if (never_up || channels_.contains(request.key.channel)) {
    variables_.on_request(request, now);
    changed_ = true;
  }
}

void MachineValues::on_answer(const machines::Answer& answer, Moment now) {
  Turn& turn = answer.requester == machines::Requester::data ? data_turn_ : variables_turn_;
  if (turn.asked == 0 || answer.number != turn.asked) {
    return;
  }
  turn.asked = 0;
  changed_ = true;
  if (answer.requester == machines::Requester::data) {
    std::visit(fabric::Cases{[&](const std::vector<data::Sampler::Resolved>& known) {
                               sampler_->on_resolved(known, answer.requests, now);
                             },
                             [&](const std::vector<data::Sampler::Answer>& values) {
                               sampler_->on_read(values, answer.requests, answer.sums, now);
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
    gives_way_ = true;
    wake_at(at);
  }
  return at;
}

void MachineValues::wake_at(std::optional<SteadyTime> time) {
  next_ = earliest({next_, time});
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
  const auto due = sampler_ ? sampler_->next_time(now.steady) : std::nullopt;
  if (!due || *due > now.steady) {
    wake_at(due);
    return;
  }
  if (time_for(data_turn_, patience, rests_since, now) > now.steady) {
    return;
  }
  data_turn_ = {};
  if (auto step = sampler_->next(now)) {
    ask(link, data_turn_, machines::Requester::data,
        std::visit([](auto&& one) -> variables::Step { return std::forward<decltype(one)>(one); },
                   *std::move(step)));
  } else if (const auto next = sampler_->next_time(now.steady)) {
    wake_at(std::max(*next, now.steady + patience.rest));
  }
}

void MachineValues::pump(machines::Controller* link, std::optional<SteadyTime> rests_since,
                         Moment now) {
  next_.reset();
  gives_way_ = false;
  variables_.on_time(now);
  if (up_ && link != nullptr) {
    // Before replies are sent: the controller's response takes longest.
    ask_variables(*link, rests_since, now);
    ask_data(*link, rests_since, now);
  } else {
    wake_at(variables_.next_time(now.steady));
  }
  publish_output(now);
}

void MachineValues::publish_output(Moment now) {
  changed_ = false;
  if (sampler_) {
    const data::Output output = sampler_->take_output();
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
  const auto program = programs_.find(sample.key.channel);
  if (program == programs_.end()) {
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
