#include "gateway/live/machine_data.hpp"

#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>

#include "base/program/barrier.hpp"
#include "fabric/cases.hpp"
#include "gateway/live/gateway_impl.hpp"
#include "gateway/live/way.hpp"

namespace millrace::gateway::live {

namespace asio = boost::asio;

/// The coroutines hold it; after stop() they end at their next step and tell nobody.
struct MachineData::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor the_executor, std::string machine, const data::DataSettings& settings,
       std::function<Moment()> clock, DataOutlet the_outlet, base::program::Log the_log)
      : executor(std::move(the_executor)),
        sampler(std::move(machine), settings),
        now(std::move(clock)),
        outlet(std::move(the_outlet)),
        log(std::move(the_log)),
        timer(executor) {}

  void tell() {
    const data::News news = sampler.take_news();
    for (const auto& sample : news.samples) {
      outlet.publish(sample);
    }
    for (const auto& sample : news.left) {
      outlet.let_go(sample);
    }
    for (const auto& line : news.lines) {
      log->log(level_of(line.level), "{}", line.text);
    }
  }

  void go_on() {
    if (stopped || !way) {
      return;
    }
    const Moment moment = now();
    const auto ready = sampler.next_time(moment.steady);
    if (!ready) {
      tell();
      return;
    }
    if (*ready > moment.steady) {
      wait_until(*ready);
      return;
    }
    if (way->calls_wait() && gave_way < patience) {
      ++gave_way;
      wait_until(moment.steady + breath);
      return;
    }
    gave_way = 0;
    auto step = sampler.next(moment);
    tell();
    if (step) {
      asio::co_spawn(executor, carry_out(shared_from_this(), way, std::move(*step)),
                     base::program::rethrow_from_loop);
    } else if (const auto next = sampler.next_time(moment.steady)) {
      wait_until(*next);
    }
  }

  void wait_until(SteadyTime time) {
    timer.expires_at(time);
    timer.async_wait([self = weak_from_this()](boost::system::error_code error) {
      if (const auto impl = self.lock(); impl && !error) {
        impl->go_on();
      }
    });
  }

  static asio::awaitable<void> carry_out(std::shared_ptr<Impl> self, std::shared_ptr<Way> way,
                                         data::Step step) {
    const std::uint64_t before = way->readings.requests();
    if (auto* look_up = std::get_if<data::LookUp>(&step)) {
      const auto known = co_await way->readings.look_up(look_up->channel, look_up->names);
      if (self->is_current(way)) {
        self->sampler.on_looked_up(known, way->readings.requests() - before, self->now());
      }
    } else {
      auto& read = std::get<data::Read>(step);
      const std::uint16_t port = read.readings.front().port;
      const auto answers = co_await way->readings.read(std::move(read.readings));
      if (self->is_current(way)) {
        self->sampler.on_read(answers, way->readings.requests() - before, way->readings.sums(port),
                              self->now());
      }
    }
    if (self->is_current(way)) {
      self->tell();
      self->go_on();
    }
  }

  /// What an earlier link answers is too late.
  [[nodiscard]] bool is_current(const std::shared_ptr<Way>& of) const {
    return !stopped && of == way;
  }

  /// Until the loop has had a turn with what came for calls.
  static constexpr std::chrono::milliseconds breath{1};
  /// Breaths that data give way for at most: a link that never rests would never tell any.
  static constexpr int patience = 50;

  asio::any_io_executor executor;
  data::Sampler sampler;
  std::function<Moment()> now;
  DataOutlet outlet;
  base::program::Log log;
  asio::steady_timer timer;
  std::weak_ptr<cnc::ads::Client> client;
  std::weak_ptr<const cnc::variables::Location> location;
  /// While the link is up.
  std::shared_ptr<Way> way;
  int gave_way = 0;
  bool stopped = false;
};

MachineData::MachineData(asio::any_io_executor executor, std::string machine,
                         const data::DataSettings& settings, std::function<Moment()> now,
                         DataOutlet outlet, base::program::Log log)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(machine), settings,
                                   std::move(now), std::move(outlet), std::move(log))) {}

MachineData::~MachineData() {
  impl_->stopped = true;
  impl_->timer.cancel();
}

void MachineData::connect(std::weak_ptr<cnc::ads::Client> client,
                          std::weak_ptr<const cnc::variables::Location> location) {
  impl_->client = std::move(client);
  impl_->location = std::move(location);
  impl_->way.reset();
}

void MachineData::on_up(const std::vector<std::uint16_t>& channels) {
  const auto client = impl_->client.lock();
  if (!impl_->way && client) {
    const auto location = impl_->location.lock();
    impl_->way = std::make_shared<Way>(client, location ? *location : cnc::variables::Location{});
  }
  impl_->sampler.on_up(channels, impl_->now().steady);
  // The looks at channels that begin with a link go first.
  impl_->wait_until(impl_->now().steady + Impl::breath);
}

void MachineData::on_down() {
  impl_->way.reset();
  // Why, the machine's status says once for all its values.
  impl_->sampler.on_down("the link is down", impl_->now());
  impl_->tell();
}

void MachineData::on_over(std::uint16_t channel) {
  if (channel == 0) {
    impl_->way.reset();
  }
  impl_->sampler.on_over(channel, impl_->now());
  impl_->tell();
}

}  // namespace millrace::gateway::live
