// The ports of the core: DDS writers, links, journal, log, timer.
#include <utility>

#include "fabric/endpoints/authentication.hpp"
#include "gateway/shell/ads_controller.hpp"
#include "gateway/shell/gateway.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::shell {

spdlog::level::level_enum level_of(Level level) {
  switch (level) {
    case Level::debug:
      return spdlog::level::debug;
    case Level::info:
      return spdlog::level::info;
    case Level::warn:
      return spdlog::level::warn;
    case Level::error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

Level min_level_of(const base::program::Log& log) {
  for (const Level level : {Level::debug, Level::info, Level::warn}) {
    if (log->should_log(level_of(level))) {
      return level;
    }
  }
  return Level::error;
}

void Gateway::publish(const fabric::Request& request) {
  if (const auto published = fabric_.calls.publish(request); !published) {
    log_->error("{}: call {} cannot be dispatched: {}", request.key.to_string(),
                request.call.to_string(), published.error());
  }
  spin_.expect();
}

void Gateway::publish(const fabric::Event& event) {
  if (const auto published = fabric_.calls.publish(event); !published) {
    log_->debug("{}: an event is lost: {}", event.key.to_string(), published.error());
  }
}

void Gateway::publish(const fabric::ChannelStatus& status) {
  fabric_.calls.publish(status);
}

void Gateway::publish(const fabric::MachineStatus& status) {
  if (const auto published = fabric_.calls.publish(status); !published) {
    log_->debug("{}: a status is lost: {}", status.machine, published.error());
  }
}

fabric::endpoints::DataEndpoint& Gateway::data_endpoint() {
  return fabric_.data ? *fabric_.data : fabric_.data.emplace(fabric_.participant);
}

void Gateway::publish(const fabric::DataSample& sample) {
  if (const auto published = data_endpoint().publish(sample); !published) {
    log_->warn("{}: data {} cannot be published: {}", sample.key.to_string(), sample.group,
               published.error());
  }
}

void Gateway::publish(const fabric::ProgramEvent& event) {
  if (const auto published = data_endpoint().publish(event); !published) {
    log_->warn("{}: an event of its NC program cannot be published: {}", event.key.to_string(),
               published.error());
  }
}

void Gateway::publish(const fabric::InstanceId& requester, const fabric::VariableReply& reply) {
  if (const auto published = variables_.publish(requester, reply); !published) {
    log_->warn("a response about variables cannot be published: {}", printable(published.error()));
  }
}

void Gateway::publish(const fabric::Outcome& outcome) {
  if (const auto published = fabric_.commands.publish(outcome); !published) {
    log_->warn("the outcome of a command cannot be published: {}", published.error());
  }
}

void Gateway::dispose(const fabric::RequestKey& request) {
  fabric_.calls.withdraw(request);
}

void Gateway::dispose(const fabric::ChannelKey& status) {
  fabric_.calls.unregister(status);
}

void Gateway::dispose(const fabric::MachineStatus& status) {
  fabric_.calls.unregister(status);
}

void Gateway::dispose(const fabric::DataSample& sample) {
  data_endpoint().unregister(sample);
}

bool Gateway::awaits_authentication() const {
  return fabric::endpoints::count_unauthenticated(fabric_.participant) > 0;
}

void Gateway::subscribe_channels() {
  fabric_.gateways.subscribe_channels();
}

Moment Gateway::now() const {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

void Gateway::wake_at(std::optional<SteadyTime> time) {
  timers_.wake.set(time);
}

std::unique_ptr<machines::Controller> Gateway::connect(const settings::MachineSettings& machine) {
  auto link = std::make_unique<AdsController>(timers_.load.get_executor(), machine, core_, log_);
  link->start();
  return link;
}

void Gateway::append(const JournalEntry& entry, const Ticket& ticket) {
  journal_->append(entry, ticket);
}

void Gateway::log(Level level, const std::string& text) {
  log_->log(level_of(level), text);
}

void Gateway::set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                        const fabric::Message& advice) {
  const auto published =
      text.empty()
          ? fabric_.alarms.clear(key.kind, key.subject)
          : fabric_.alarms.raise(
                {.key = key, .level = fabric::AlarmLevel::problem, .text = text, .advice = advice});
  if (!published) {
    log_->warn("the alarm cannot be published and is only in this log: {}", published.error());
  }
}

void Gateway::may_end(bool half_written) {
  if (half_written) {
    log_->warn("ending in the middle of a response; the journal completes it after a restart");
  }
  boost::asio::post(timers_.load.get_executor(), [this, then = std::exchange(finished_, {})] {
    core_.end();
    then();
  });
}

}  // namespace millrace::gateway::shell
