// What the core's decisions do: DDS writers, links, journal, log, timer.
#include <utility>

#include "gateway/shell/ads_controller.hpp"
#include "gateway/shell/gateway_impl.hpp"
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

Level min_level_of(const base::program::Log& logger) {
  for (const Level level : {Level::debug, Level::info, Level::warn}) {
    if (logger->should_log(level_of(level))) {
      return level;
    }
  }
  return Level::error;
}

void Gateway::Impl::publish(const fabric::Request& request) {
  if (const auto published = call_end.publish(request); !published) {
    logger->error("{}: call {} cannot be given out: {}", request.key.to_string(),
                  request.call.to_string(), published.error());
  }
  spin.expect();
}

void Gateway::Impl::publish(const fabric::Event& event) {
  if (const auto published = call_end.publish(event); !published) {
    logger->debug("{}: an event is lost: {}", event.key.to_string(), published.error());
  }
}

void Gateway::Impl::publish(const fabric::ChannelStatus& status) {
  if (const auto published = call_end.publish(status); !published) {
    logger->debug("{}: a status is lost: {}", status.key.to_string(), published.error());
  }
}

void Gateway::Impl::publish(const fabric::MachineStatus& status) {
  if (const auto published = call_end.publish(status); !published) {
    logger->debug("{}: a status is lost: {}", status.machine, published.error());
  }
}

fabric::ends::DataEnd& Gateway::Impl::data_end() {
  return data ? *data : data.emplace(participant);
}

void Gateway::Impl::publish(const fabric::DataSample& sample) {
  if (const auto published = data_end().publish(sample); !published) {
    logger->warn("{}: data {} cannot be told: {}", sample.key.to_string(), sample.group,
                 published.error());
  }
}

void Gateway::Impl::publish(const fabric::ProgramEvent& event) {
  if (const auto published = data_end().publish(event); !published) {
    logger->warn("{}: an event of its program cannot be told: {}", event.key.to_string(),
                 published.error());
  }
}

void Gateway::Impl::publish(const fabric::InstanceId& asker, const fabric::VariableReply& reply) {
  if (const auto published = variables.publish(asker, reply); !published) {
    logger->warn("an answer about variables cannot be told: {}", printable(published.error()));
  }
}

void Gateway::Impl::publish(const fabric::Outcome& outcome) {
  if (const auto published = command_end.publish(outcome); !published) {
    logger->warn("the outcome of a command cannot be told: {}", published.error());
  }
}

void Gateway::Impl::dispose(const fabric::RequestKey& request) {
  call_end.withdraw(request);
}

void Gateway::Impl::dispose(const fabric::ChannelKey& status) {
  call_end.let_go(status);
}

void Gateway::Impl::dispose(const fabric::MachineStatus& status) {
  call_end.let_go(status);
}

void Gateway::Impl::dispose(const fabric::DataSample& sample) {
  data_end().let_go(sample);
}

void Gateway::Impl::watch_channels() {
  watch.watch_channels();
}

Moment Gateway::Impl::now() const {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

void Gateway::Impl::wake_at(std::optional<SteadyTime> time) {
  // One that is armed for an earlier time comes too early: that costs less than to move it.
  if (!time || (armed && *armed <= *time)) {
    return;
  }
  armed = time;
  timer.expires_at(*time);
  timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      armed.reset();
      core.on_time();
    }
  });
}

std::unique_ptr<machines::Controller> Gateway::Impl::connect(
    const settings::MachineSettings& machine) {
  auto link = std::make_unique<AdsController>(executor, machine, core, logger);
  link->start();
  return link;
}

void Gateway::Impl::append(const JournalEntry& entry, const Ticket& ticket) {
  journal->append(entry, ticket);
}

void Gateway::Impl::log(Level level, const std::string& text) {
  logger->log(level_of(level), text);
}

void Gateway::Impl::notice(const fabric::NoticeKey& key, const std::string& text,
                           const std::string& advice) {
  const auto told = text.empty() ? notices.clear(key.kind, key.subject)
                                 : notices.raise({.key = key,
                                                  .level = fabric::NoticeLevel::problem,
                                                  .text = text,
                                                  .advice = advice});
  if (!told) {
    logger->warn("nobody but this log is told of it: {}", told.error());
  }
}

void Gateway::Impl::may_end(bool half_written) {
  if (half_written) {
    logger->warn("ending with an answer half written; the journal knows how to go on");
  }
  boost::asio::post(executor, [this, then = std::exchange(finished, {})] {
    core.end();
    then();
  });
}

}  // namespace millrace::gateway::shell
