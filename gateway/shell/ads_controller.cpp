#include "gateway/shell/ads_controller.hpp"

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <variant>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/program/barrier.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/probe.hpp"
#include "cnc/variables/state_subscriptions.hpp"
#include "gateway/settings/client_options.hpp"
#include "gateway/shell/ads_message_queue.hpp"
#include "gateway/shell/ads_service_access.hpp"
#include "gateway/shell/back_off.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;
using cnc::ads::ErrorCode;
using Channels = std::vector<std::uint16_t>;

/// A later request would give the same error.
bool is_final(ErrorCode code) {
  return cnc::ads::is_refusal(code) || code == ErrorCode::no_more_handles ||
         code == ErrorCode::transmission_not_supported || code == ErrorCode::access_denied ||
         code == ErrorCode::client_unknown || code == ErrorCode::protocol_error;
}

std::string list_of(const Channels& channels) {
  std::string words = channels.size() == 1 ? "channel" : "channels";
  for (const std::uint16_t channel : channels) {
    words += fmt::format("{}{}", channel == channels.front() ? " " : ", ", channel);
  }
  return words;
}

}  // namespace

/// Kept alive by its coroutines; after stop() they end at their next step without an event.
struct AdsController::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor the_executor, settings::MachineSettings the_settings,
       machines::ControllerEvents& the_events, base::program::Log the_log)
      : executor(std::move(the_executor)),
        settings(std::move(the_settings)),
        events(the_events),
        log(std::move(the_log)),
        client(executor, client_options(settings)),
        interfaces(executor, settings.name, client, events),
        subscriptions(client, settings.symbol, [this](auto&&... what) { report(what...); }),
        timer(executor),
        back_off(std::random_device{}()) {}

  void stop() {
    stopped = true;
    interfaces.stop();
    client.on_down({});
    subscriptions.leave();
    timer.cancel();
  }

  asio::awaitable<void> wait(std::chrono::milliseconds time) {
    timer.expires_after(time);
    boost::system::error_code ignored;
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

  /// Waits until the link ends; then `loss` has the reason.
  asio::awaitable<void> wait_for_the_end() {
    while (!stopped && !loss) {
      timer.expires_at(asio::steady_timer::time_point::max());
      boost::system::error_code ignored;
      co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  /// The channels to serve; nullopt, and logged, if the controller has none or does not respond.
  asio::awaitable<std::optional<Channels>> find_channels() {
    if (!settings.channels.empty()) {
      co_return settings.channels;
    }
    const auto found = co_await cnc::variables::survey(client, location);
    if (!found || found->channels == 0) {
      warn_limited(found ? found->finding
                         : base::messages::channels_not_counted(cnc::ads::describe(found.error())));
      co_return std::nullopt;
    }
    Channels channels;
    for (std::uint32_t number = 1; number <= found->channels; ++number) {
      channels.push_back(static_cast<std::uint16_t>(number));
    }
    co_return channels;
  }

  /// The index groups of the variables; nullopt, and logged, if the request fails.
  asio::awaitable<std::optional<cnc::variables::Location>> find_groups() {
    const std::uint16_t channel = settings.channels.empty() ? 1 : settings.channels.front();
    const auto found = co_await cnc::variables::locate(client, channel, cnc::variables::Location{});
    if (!found) {
      warn_limited(base::messages::groups_not_found(cnc::ads::describe(found.error())));
      co_return std::nullopt;
    }
    co_return *found;
  }

  /// Returns how long there was a link.
  asio::awaitable<std::chrono::nanoseconds> serve_once() {
    loss.reset();
    const auto connected = co_await client.connect();
    if (stopped) {
      co_return std::chrono::nanoseconds(0);
    }
    if (!connected) {
      warn_limited(connected.error().message);
      co_return std::chrono::nanoseconds(0);
    }
    const auto groups = co_await find_groups();
    if (stopped || !groups) {
      client.close();
      co_return std::chrono::nanoseconds(0);
    }
    location = *groups;
    const auto channels = co_await find_channels();
    if (stopped || !channels) {
      client.close();
      co_return std::chrono::nanoseconds(0);
    }
    interfaces.begin(location);
    for (auto& source : sources) {
      source = std::make_shared<ValueSource>(client, location);
    }
    subscriptions.forget();
    queues.clear();
    ++connections;
    last_warning.clear();
    log->info("{}: link up, {}", settings.to_string(), list_of(*channels));
    const auto up_since = std::chrono::steady_clock::now();
    events.on_link_up(settings.name, *channels);
    co_await wait_for_the_end();
    const auto lasted = std::chrono::steady_clock::now() - up_since;
    if (!stopped) {
      log->warn("{}: link down: {}", settings.name, loss->reason);
      last_warning = loss->reason;
      events.on_link_down(settings.name, *loss);
    }
    co_return lasted;
  }

  static asio::awaitable<void> run(std::shared_ptr<Impl> self) {
    while (!self->stopped) {
      const auto lasted = co_await self->serve_once();
      if (!self->stopped) {
        co_await self->wait(self->back_off.next(lasted));
      }
    }
  }

  /// Once for each reason, so that a controller that is off for a night does not fill the log.
  void warn_limited(const fabric::Message& reason) {
    if (last_warning != reason) {
      last_warning = reason;
      log->warn("{}: {}; trying again", settings.to_string(), reason);
      events.on_link_down(settings.name, machines::LinkLoss(reason));
    }
  }

  /// Subscribes or unsubscribes; one request after the other.
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
        co_await self->subscriptions.unsubscribe(job.channels);
        continue;
      }
      const auto outcomes = co_await self->subscriptions.subscribe(job.channels);
      if (!self->stopped && job.connection == self->connections && self->client.up()) {
        self->report(outcomes);
      }
    }
    self->working = false;
  }

  static asio::awaitable<void> ask(std::shared_ptr<Impl> self, machines::Question question) {
    const std::uint64_t connection = self->connections;
    const auto& source = self->sources.at(static_cast<std::size_t>(question.requester));
    const machines::Answer answer = co_await ask_values(source, std::move(question));
    if (!self->stopped && connection == self->connections) {
      self->events.on_answer(self->settings.name, answer);
    }
  }

  /// It was not replaced since, and its connection still exists.
  [[nodiscard]] bool is_open(const fabric::ChannelKey& key,
                             const std::shared_ptr<AdsMessageQueue>& queue) const {
    const auto open = queues.find(key);
    return !stopped && open != queues.end() && open->second == queue;
  }

  static asio::awaitable<void> ask(std::shared_ptr<Impl> self, fabric::ChannelKey key,
                                   std::shared_ptr<AdsMessageQueue> queue, queues::Step step) {
    queues::StepAnswer answer = co_await queue->ask(step);
    if (self->is_open(key, queue)) {
      self->events.on_queue_answer(key, std::move(answer));
    }
  }

  static asio::awaitable<void> watch(std::shared_ptr<Impl> self, fabric::ChannelKey key,
                                     std::shared_ptr<AdsMessageQueue> queue) {
    std::function<void()> on_event = [weak = std::weak_ptr(self), key, of = std::weak_ptr(queue)] {
      if (const auto link = weak.lock(); link && link->is_open(key, of.lock())) {
        link->events.on_queue_event(key);
      }
    };
    co_await queue->watch(std::move(on_event));
  }

  void report(const std::vector<cnc::variables::SubscriptionOutcome>& outcomes) {
    std::vector<machines::SubscribeOutcome> all;
    all.reserve(outcomes.size());
    for (const auto& outcome : outcomes) {
      all.push_back({outcome.channel, outcome.refusal, !is_final(outcome.error)});
    }
    events.on_subscribed(settings.name, all);
  }

  void report(std::uint16_t channel, Variable variable, std::optional<std::uint32_t> value) {
    if (!stopped) {
      events.on_notification({settings.name, channel}, variable, value);
    }
  }

  asio::any_io_executor executor;
  settings::MachineSettings settings;
  machines::ControllerEvents& events;
  base::program::Log log;
  cnc::ads::Client client;
  AdsServiceAccess interfaces;
  /// The location of the controller's variables.
  cnc::variables::Location location;
  cnc::variables::StateSubscriptions subscriptions;
  /// Of this connection, one for each machines::Requester.
  std::array<std::shared_ptr<ValueSource>, 2> sources;
  /// Message queues, of this connection.
  std::map<fabric::ChannelKey, std::shared_ptr<AdsMessageQueue>> queues;
  std::deque<WatchJob> jobs;
  bool working = false;
  /// Counts the links that came up.
  std::uint64_t connections = 0;
  asio::steady_timer timer;
  BackOff back_off;
  std::optional<machines::LinkLoss> loss;
  std::string last_warning;
  bool stopped = false;
};

AdsController::AdsController(asio::any_io_executor executor, settings::MachineSettings settings,
                             machines::ControllerEvents& events, base::program::Log log)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(settings), events,
                                   std::move(log))) {
  impl_->client.on_down([impl = impl_.get()](const cnc::ads::LinkError& error) {
    impl->loss.emplace(error.message, error.silent_for);
    impl->timer.cancel();
  });
}

AdsController::~AdsController() {
  impl_->stop();
}

void AdsController::start() {
  asio::co_spawn(impl_->executor, Impl::run(impl_), base::program::rethrow_from_loop);
}

void AdsController::read(std::uint16_t channel, ReadSet set) {
  impl_->interfaces.read(impl_, channel, set);
}

void AdsController::write(std::uint16_t channel, Variable variable, const Value& value) {
  impl_->interfaces.write(impl_, channel, variable, value);
}

void AdsController::subscribe(const std::vector<std::uint16_t>& channels) {
  impl_->add_job(channels, true);
}

void AdsController::unsubscribe(const std::vector<std::uint16_t>& channels) {
  impl_->add_job(channels, false);
}

void AdsController::ask(const machines::Question& question) {
  // A closed connection responds at once.
  asio::post(impl_->executor, [impl = impl_, question] {
    asio::co_spawn(impl->executor, Impl::ask(impl, question), base::program::rethrow_from_loop);
  });
}

void AdsController::open(const fabric::ChannelKey& queue, const queues::QueueSettings& settings) {
  impl_->queues.insert_or_assign(queue, std::make_shared<AdsMessageQueue>(impl_->client, settings));
}

void AdsController::ask(const fabric::ChannelKey& queue, const queues::Step& step) {
  asio::post(impl_->executor, [impl = impl_, queue, open = impl_->queues.at(queue), step] {
    asio::co_spawn(impl->executor, Impl::ask(impl, queue, open, step),
                   base::program::rethrow_from_loop);
  });
}

void AdsController::subscribe(const fabric::ChannelKey& queue) {
  asio::co_spawn(impl_->executor, Impl::watch(impl_, queue, impl_->queues.at(queue)),
                 base::program::rethrow_from_loop);
}

machines::LinkLoad AdsController::load() const {
  const auto& counters = impl_->client.counters();
  return {counters.requests, counters.answered, counters.waited};
}

boost::asio::awaitable<machines::Answer> ask_values(std::shared_ptr<ValueSource> source,
                                                    machines::Question question) {
  cnc::variables::Readings& readings = source->readings;
  const std::uint64_t before = readings.requests();
  machines::Answer answer;
  answer.requester = question.requester;
  answer.number = question.number;
  if (auto* look_up = std::get_if<data::Resolve>(&question.step)) {
    answer.found = co_await readings.look_up(look_up->channel, std::move(look_up->names));
  } else if (auto* read = std::get_if<data::Read>(&question.step)) {
    const std::uint16_t port = read->readings.front().port;
    answer.found = co_await readings.read(std::move(read->readings));
    answer.sums = readings.sums(port);
  } else if (auto* write = std::get_if<variables::WriteOne>(&question.step)) {
    cnc::variables::Channel channel(source->client, write->channel, source->location);
    answer.found = co_await channel.write(write->name, write->value);
    answer.requests = 1;
    co_return answer;
  } else {
    const auto& list = std::get<variables::ListPage>(question.step);
    auto page = co_await readings.list_page(list.channel, list.family, list.first,
                                            fabric::variables_of_a_page);
    answer.found = std::move(page).map([](cnc::variables::Readings::Page&& found) {
      return variables::Page{found.total, std::move(found.variables)};
    });
  }
  answer.requests = readings.requests() - before;
  co_return answer;
}

}  // namespace millrace::gateway::shell
