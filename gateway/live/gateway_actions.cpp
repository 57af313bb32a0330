// Carries out what the call control decides.
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "gateway/live/gateway_impl.hpp"

namespace millrace::gateway::live {

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

Level least_of(const base::program::Log& log) {
  for (const Level level : {Level::debug, Level::info, Level::warn}) {
    if (log->should_log(level_of(level))) {
      return level;
    }
  }
  return Level::error;
}

void Gateway::Impl::carry_out(control::ChannelActions actions) {
  for (const control::ChannelAction& one : actions) {
    std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
  }
  control.recycle(std::move(actions));
  arm_timer();
  if (finished && !control.answering()) {
    end();
  }
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Read& action) {
  queues.has(key) ? queues.read(key, action.look) : machines.read(key, action.look);
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Write& action) {
  if (queues.has(key)) {
    queues.write(key, action);
  } else {
    machines.write(key, action.variable, action.value);
  }
}

void Gateway::Impl::carry_out(const fabric::ChannelKey&, const Record& action) {
  journal->append(action.entry, action.ticket);
}

void Gateway::Impl::on_recorded(const Ticket& ticket) {
  begin_event();
  if (ticket.owner == Ticket::Owner::queue) {
    queues.on_recorded(ticket);
  } else {
    carry_out(control.on_recorded(ticket, now()));
  }
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Publish& action) {
  if (const auto published = call_end.publish(action.request); !published) {
    log->error("{}: call {} cannot be given out: {}", key.to_string(),
               action.request.call.to_string(), published.error());
  }
  spin.expect();
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Withdraw& action) {
  call_end.withdraw({key, action.epoch, action.instance});
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Tell& action) {
  if (const auto published = call_end.publish(action.event); !published) {
    log->debug("{}: an event is lost: {}", key.to_string(), published.error());
  }
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Show& action) {
  if (const auto published = call_end.publish(action.status); !published) {
    log->debug("{}: a status is lost: {}", key.to_string(), published.error());
  }
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Hide&) {
  call_end.let_go(key);
  queues.has(key) ? queues.on_over(key) : machines.on_over(key);
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const Say& action) {
  log->log(level_of(action.level), "{}: {}", key.to_string(), action.text);
}

void Gateway::Impl::carry_out(const fabric::ChannelKey& key, const WriteProblem& action) {
  set_notice(
      {.kind = "write", .subject = key.to_string()},
      action.text.empty() ? "" : fmt::format("{}: {}", key.to_string(), action.text),
      "the NC program waits; check whether the controller runs, and whether a PLC or another "
      "ADS client writes V.G.SERVICE of this channel; the gateway repeats the write at least "
      "once a minute");
}

}  // namespace millrace::gateway::live
