#include "gateway/live/machine_link.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "base/program/barrier.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/request_states.hpp"
#include "cnc/variables/service_interface.hpp"
#include "cnc/variables/state_notices.hpp"
#include "cnc/variables/survey.hpp"
#include "gateway/live/client_options.hpp"
#include "gateway/machines/back_off.hpp"

namespace millrace::gateway::live {

namespace {

namespace asio = boost::asio;
using cnc::ads::ErrorCode;
using Channels = std::vector<std::uint16_t>;

bool link_gone(ErrorCode code) {
  return code == ErrorCode::link_lost || code == ErrorCode::link_down ||
         code == ErrorCode::cancelled;
}

/// A controller that is asked again later would say the same.
bool is_final(ErrorCode code) {
  return cnc::ads::is_refusal(code) || code == ErrorCode::no_more_handles ||
         code == ErrorCode::transmission_not_supported || code == ErrorCode::access_denied ||
         code == ErrorCode::client_unknown || code == ErrorCode::protocol_error;
}

WriteOutcome outcome_of(ErrorCode code) {
  return cnc::ads::leaves_outcome_unknown(code) ? WriteOutcome::unknown : WriteOutcome::refused;
}

Snapshot snapshot_of(ReadSet look, std::vector<cnc::variables::ServiceValue> values) {
  Snapshot snapshot;
  snapshot.look = look;
  const auto variables = variables_of(look);
  for (std::size_t i = 0; i < variables.size(); ++i) {
    switch (variables[i]) {
      case Variable::uuid:
        snapshot.uuid = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request:
        snapshot.request = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request_state:
        snapshot.request_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response_state:
        snapshot.response_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response:
        snapshot.response = std::get<std::string>(std::move(values[i]));
        break;
    }
  }
  return snapshot;
}

Snapshot snapshot_of(std::uint32_t request_state) {
  Snapshot snapshot;
  snapshot.look = ReadSet::state;
  snapshot.request_state = request_state;
  return snapshot;
}

/// In one request: a controller does the items of a sum one after the other, and others wait.
constexpr std::size_t most_together = 64;

std::string list_of(const Channels& channels) {
  std::string words = channels.size() == 1 ? "channel" : "channels";
  for (const std::uint16_t channel : channels) {
    words += fmt::format("{}{}", channel == channels.front() ? " " : ", ", channel);
  }
  return words;
}

}  // namespace

/// The coroutines hold it; after stop() they end at their next step and tell nobody.
struct MachineLink::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor the_executor, settings::MachineSettings the_settings,
       machines::LinkEvents& the_events, base::program::Log the_log)
      : executor(std::move(the_executor)),
        settings(std::move(the_settings)),
        events(the_events),
        log(std::move(the_log)),
        client(executor, client_options(settings)),
        states(client),
        notices(client, settings.symbol, [this](auto&&... what) { tell(what...); }),
        timer(executor),
        back_off(std::random_device{}()) {}

  void stop() {
    stopped = true;
    client.on_down({});
    notices.leave();
    timer.cancel();
  }

  asio::awaitable<void> wait(std::chrono::milliseconds time) {
    timer.expires_after(time);
    boost::system::error_code ignored;
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

  /// Until the link ends; then `down_reason` says why.
  asio::awaitable<void> wait_for_the_end() {
    while (!stopped && !down_reason) {
      timer.expires_at(asio::steady_timer::time_point::max());
      boost::system::error_code ignored;
      co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  /// The channels to serve; nothing, and said why, if the controller has none or does not answer.
  asio::awaitable<std::optional<Channels>> find_channels() {
    if (!settings.channels.empty()) {
      co_return settings.channels;
    }
    const auto found = co_await cnc::variables::survey(client, location);
    if (!found || found->channels == 0) {
      complain(found ? found->finding
                     : fmt::format("its channels cannot be counted: {}",
                                   cnc::ads::describe(found.error())));
      co_return std::nullopt;
    }
    Channels channels;
    for (std::uint32_t number = 1; number <= found->channels; ++number) {
      channels.push_back(static_cast<std::uint16_t>(number));
    }
    co_return channels;
  }

  /// In which index groups the variables are; nothing, and said why, if that cannot be asked.
  asio::awaitable<std::optional<cnc::variables::Location>> find_groups() {
    const std::uint16_t channel = settings.channels.empty() ? 1 : settings.channels.front();
    cnc::variables::Location configured;
    if (settings.groups == settings::Groups::old) {
      configured.group -= cnc::variables::new_group_bit;
    }
    if (settings.groups != settings::Groups::probe) {
      co_return configured;
    }
    const auto found = co_await cnc::variables::locate(client, channel, configured);
    if (!found) {
      complain(
          fmt::format("its index groups cannot be found: {}", cnc::ads::describe(found.error())));
      co_return std::nullopt;
    }
    co_return *found;
  }

  asio::awaitable<void> serve_once() {
    down_reason.reset();
    const auto connected = co_await client.connect();
    if (stopped) {
      co_return;
    }
    if (!connected) {
      complain(connected.error().message);
      co_return;
    }
    const auto groups = co_await find_groups();
    if (stopped || !groups) {
      client.close();
      co_return;
    }
    if (location.group != groups->group) {
      location = *groups;
      services.clear();
    }
    const auto channels = co_await find_channels();
    if (stopped || !channels) {
      client.close();
      co_return;
    }
    for (const std::uint16_t channel : *channels) {
      service(channel).forget();
    }
    states.forget(location);
    notices.forget();
    ++connections;
    complaint.clear();
    back_off.reset();
    log->info("{}: link up, {}", settings.to_string(), list_of(*channels));
    events.on_link_up(settings.name, *channels);
    co_await wait_for_the_end();
    if (!stopped) {
      log->warn("{}: link down: {}", settings.name, *down_reason);
      complaint = *down_reason;
      events.on_link_down(settings.name, *down_reason);
    }
  }

  static asio::awaitable<void> run(std::shared_ptr<Impl> self) {
    while (!self->stopped) {
      co_await self->serve_once();
      if (!self->stopped) {
        co_await self->wait(self->back_off.next());
      }
    }
  }

  cnc::variables::ServiceInterface& service(std::uint16_t channel) {
    const cnc::variables::ServiceAccess access{.location = location};
    return services.try_emplace(channel, client, channel, access).first->second;
  }

  /// Once for each reason, so that a controller that is off for a night fills no log.
  void complain(const std::string& reason) {
    if (complaint != reason) {
      complaint = reason;
      log->warn("{}: {}; trying again", settings.to_string(), reason);
      events.on_link_down(settings.name, reason);
    }
  }

  static asio::awaitable<void> read(std::shared_ptr<Impl> self, std::uint16_t channel,
                                    ReadSet look) {
    const auto looked_at = variables_of(look);
    std::vector<Variable> variables(looked_at.begin(), looked_at.end());
    auto& service = self->service(channel);
    auto values = co_await service.read(std::move(variables));
    if (self->stopped) {
      co_return;
    }
    if (values) {
      self->events.on_read({self->settings.name, channel}, snapshot_of(look, std::move(*values)));
    } else {
      self->read_failed(channel, values.error());
    }
  }

  void read_failed(std::uint16_t channel, ErrorCode code) {
    events.on_read_failed({settings.name, channel},
                          link_gone(code)
                              ? std::string()
                              : fmt::format("the controller does not let us read the Service "
                                            "Interface of channel {}: {}",
                                            channel, cnc::ads::describe(code)));
  }

  /// Channels of one period are due together: one request for all of them.
  void look_soon(std::uint16_t channel) {
    looking.push_back(channel);
    if (looking.size() == 1) {
      asio::post(executor, [self = shared_from_this()] { self->look_together(); });
    }
  }

  void look_together() {
    const Channels due = std::exchange(looking, {});
    if (due.size() == 1) {
      asio::co_spawn(executor, read(shared_from_this(), due.front(), ReadSet::state),
                     base::program::rethrow_from_loop);
      return;
    }
    for (std::size_t i = 0; i < due.size(); i += most_together) {
      const auto end = std::min(i + most_together, due.size());
      Channels some(due.begin() + static_cast<std::ptrdiff_t>(i),
                    due.begin() + static_cast<std::ptrdiff_t>(end));
      asio::co_spawn(executor, read_states(shared_from_this(), std::move(some)),
                     base::program::rethrow_from_loop);
    }
  }

  static asio::awaitable<void> read_states(std::shared_ptr<Impl> self, Channels channels) {
    const auto found = co_await self->states.read(channels);
    for (std::size_t i = 0; i < channels.size() && !self->stopped; ++i) {
      if (found[i]) {
        self->events.on_read({self->settings.name, channels[i]}, snapshot_of(*found[i]));
      } else {
        self->read_failed(channels[i], found[i].error());
      }
    }
  }

  /// To be watched, or not any more; one question after the other.
  struct WatchJob {
    Channels channels;
    bool wanted = false;
    std::uint64_t connection = 0;
  };

  void add_job(const Channels& channels, bool wanted) {
    jobs.push_back({channels, wanted, connections});
    if (!working) {
      working = true;
      asio::co_spawn(executor, work(shared_from_this()), base::program::rethrow_from_loop);
    }
  }

  static asio::awaitable<void> work(std::shared_ptr<Impl> self) {
    while (!self->stopped && !self->jobs.empty()) {
      const WatchJob job = std::move(self->jobs.front());
      self->jobs.pop_front();
      if (job.connection != self->connections || !self->client.up()) {
        continue;
      }
      if (!job.wanted) {
        co_await self->notices.unwatch(job.channels);
        continue;
      }
      const auto outcomes = co_await self->notices.watch(job.channels);
      if (!self->stopped && job.connection == self->connections && self->client.up()) {
        self->tell(outcomes);
      }
    }
    self->working = false;
  }

  void tell(const std::vector<cnc::variables::NoticeOutcome>& outcomes) {
    std::vector<machines::WatchOutcome> all;
    for (const auto& outcome : outcomes) {
      all.push_back({outcome.channel, outcome.refusal, !is_final(outcome.error)});
    }
    events.on_watched(settings.name, all);
  }

  void tell(std::uint16_t channel, Variable variable, std::optional<std::uint32_t> value) {
    if (!stopped) {
      events.on_told({settings.name, channel}, variable, value);
    }
  }

  static asio::awaitable<void> write(std::shared_ptr<Impl> self, std::uint16_t channel,
                                     Variable variable, Value value) {
    auto& service = self->service(channel);
    const auto written = co_await service.write(variable, std::move(value));
    if (self->stopped) {
      co_return;
    }
    const fabric::ChannelKey key{self->settings.name, channel};
    if (written) {
      self->events.on_write(key, WriteOutcome::written, "");
    } else {
      self->events.on_write(key, outcome_of(written.error()),
                            fmt::format("{} of channel {} cannot be written: {}", name_of(variable),
                                        channel, cnc::ads::describe(written.error())));
    }
  }

  asio::any_io_executor executor;
  settings::MachineSettings settings;
  machines::LinkEvents& events;
  base::program::Log log;
  cnc::ads::Client client;
  cnc::variables::RequestStates states;
  /// Whose REQUEST_STATE is looked at when this turn of the loop is over.
  Channels looking;
  std::map<std::uint16_t, cnc::variables::ServiceInterface> services;
  /// Where the controller keeps its variables.
  cnc::variables::Location location;
  cnc::variables::StateNotices notices;
  std::deque<WatchJob> jobs;
  bool working = false;
  /// Counts the links that came up.
  std::uint64_t connections = 0;
  asio::steady_timer timer;
  machines::BackOff back_off;
  std::optional<std::string> down_reason;
  std::string complaint;
  bool stopped = false;
};

MachineLink::MachineLink(asio::any_io_executor executor, settings::MachineSettings settings,
                         machines::LinkEvents& events, base::program::Log log)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(settings), events,
                                   std::move(log))) {
  impl_->client.on_down([impl = impl_.get()](const cnc::ads::LinkError& error) {
    impl->down_reason = error.message;
    impl->timer.cancel();
  });
}

MachineLink::~MachineLink() {
  impl_->stop();
}

void MachineLink::start() {
  asio::co_spawn(impl_->executor, Impl::run(impl_), base::program::rethrow_from_loop);
}

void MachineLink::read(std::uint16_t channel, ReadSet look) {
  if (look == ReadSet::state) {
    impl_->look_soon(channel);
  } else {
    asio::co_spawn(impl_->executor, Impl::read(impl_, channel, look),
                   base::program::rethrow_from_loop);
  }
}

void MachineLink::write(std::uint16_t channel, Variable variable, const Value& value) {
  asio::co_spawn(impl_->executor, Impl::write(impl_, channel, variable, value),
                 base::program::rethrow_from_loop);
}

void MachineLink::watch(const std::vector<std::uint16_t>& channels) {
  impl_->add_job(channels, true);
}

void MachineLink::unwatch(const std::vector<std::uint16_t>& channels) {
  impl_->add_job(channels, false);
}

std::weak_ptr<cnc::ads::Client> MachineLink::client() const {
  return std::shared_ptr<cnc::ads::Client>(impl_, &impl_->client);
}

std::weak_ptr<const cnc::variables::Location> MachineLink::location() const {
  return std::shared_ptr<const cnc::variables::Location>(impl_, &impl_->location);
}

machines::LinkLoad MachineLink::load() const {
  const auto& counters = impl_->client.counters();
  return {counters.requests, counters.answered, counters.waited};
}

}  // namespace millrace::gateway::live
