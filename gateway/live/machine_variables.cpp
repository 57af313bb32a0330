#include "gateway/live/machine_variables.hpp"

#include <optional>
#include <utility>
#include <variant>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>

#include "base/program/barrier.hpp"
#include "gateway/live/gateway_impl.hpp"
#include "gateway/live/way.hpp"

namespace millrace::gateway::live {

namespace asio = boost::asio;

/// The coroutines hold it; after stop() they end at their next step and tell nobody.
struct MachineVariables::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor the_executor, std::string machine,
       const variables::VariableSettings& settings, std::function<Moment()> clock,
       VariableOutlet the_outlet, base::program::Log the_log)
      : executor(std::move(the_executor)),
        desk(std::move(machine), settings),
        now(std::move(clock)),
        outlet(std::move(the_outlet)),
        log(std::move(the_log)),
        timer(executor) {}

  void tell() {
    const variables::News news = desk.take_news();
    for (const auto& answer : news.answers) {
      outlet.answer(answer.asker, answer.reply);
    }
    for (const auto& written : news.written) {
      outlet.written(written);
    }
    for (const auto& line : news.lines) {
      log->log(level_of(line.level), "{}", line.text);
    }
  }

  void go_on() {
    if (stopped) {
      return;
    }
    const Moment moment = now();
    desk.on_time(moment);
    if (!way || asking) {
      tell();
      wait_for_next(moment);
      return;
    }
    const auto due = desk.next_time(moment.steady);
    if (due && *due <= moment.steady && way->calls_wait() && gave_way < patience) {
      ++gave_way;
      tell();
      wait_until(moment.steady + breath);
      return;
    }
    gave_way = 0;
    auto step = desk.next(moment);
    if (step) {
      // Before who asked is told of anything: the controller's answer takes longest.
      asking = true;
      asio::co_spawn(executor, carry_out(shared_from_this(), way, std::move(*step)),
                     base::program::rethrow_from_loop);
    }
    tell();
    wait_for_next(moment);
  }

  void wait_for_next(Moment moment) {
    if (const auto next = desk.next_time(moment.steady)) {
      wait_until(*next);
    } else {
      waits_until.reset();
      timer.cancel();
    }
  }

  void wait_until(SteadyTime time) {
    if (waits_until == time) {
      return;
    }
    waits_until = time;
    timer.expires_at(time);
    timer.async_wait([self = weak_from_this()](boost::system::error_code error) {
      if (const auto impl = self.lock(); impl && !error) {
        impl->waits_until.reset();
        impl->go_on();
      }
    });
  }

  static asio::awaitable<void> carry_out(std::shared_ptr<Impl> self, std::shared_ptr<Way> way,
                                         variables::Step step) {
    const std::uint64_t before = way->readings.requests();
    if (auto* look_up = std::get_if<data::LookUp>(&step)) {
      const auto found = co_await way->readings.look_up(look_up->channel, look_up->names);
      if (self->is_current(way)) {
        self->desk.on_looked_up(found, way->readings.requests() - before, self->now());
      }
    } else if (auto* read = std::get_if<data::Read>(&step)) {
      const std::uint16_t port = read->readings.front().port;
      const auto answers = co_await way->readings.read(std::move(read->readings));
      if (self->is_current(way)) {
        self->desk.on_read(answers, way->readings.requests() - before, way->readings.sums(port),
                           self->now());
      }
    } else if (auto* write = std::get_if<variables::WriteOne>(&step)) {
      cnc::variables::Channel channel(*way->client, write->channel, way->location);
      const auto written = co_await channel.write(write->name, write->value);
      if (self->is_current(way)) {
        self->desk.on_written(written, 1, self->now());
      }
    } else {
      const auto& list = std::get<variables::ListPage>(step);
      auto page = co_await way->readings.list_page(list.channel, list.family, list.first,
                                                   fabric::variables_of_a_page);
      if (self->is_current(way)) {
        self->desk.on_listed(std::move(page).map([](cnc::variables::Readings::Page&& found) {
          return variables::Page{found.total, std::move(found.variables)};
        }),
                             way->readings.requests() - before, self->now());
      }
    }
    if (self->is_current(way)) {
      self->asking = false;
      self->go_on();
    }
  }

  /// What an earlier link answers is too late.
  [[nodiscard]] bool is_current(const std::shared_ptr<Way>& of) const {
    return !stopped && of == way;
  }

  /// What is asked is not answered any more.
  void break_off() {
    way.reset();
    asking = false;
  }

  /// Until the loop has had a turn with what came for calls.
  static constexpr std::chrono::microseconds breath{250};
  /// Breaths that questions give way for at most: a link that never rests would never answer any.
  static constexpr int patience = 100;

  asio::any_io_executor executor;
  variables::Desk desk;
  std::function<Moment()> now;
  VariableOutlet outlet;
  base::program::Log log;
  asio::steady_timer timer;
  std::optional<SteadyTime> waits_until;
  std::weak_ptr<cnc::ads::Client> client;
  std::weak_ptr<const cnc::variables::Location> location;
  /// While the link is up.
  std::shared_ptr<Way> way;
  /// A step is under way.
  bool asking = false;
  int gave_way = 0;
  bool stopped = false;
};

MachineVariables::MachineVariables(asio::any_io_executor executor, std::string machine,
                                   const variables::VariableSettings& settings,
                                   std::function<Moment()> now, VariableOutlet outlet,
                                   base::program::Log log)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(machine), settings,
                                   std::move(now), std::move(outlet), std::move(log))) {}

MachineVariables::~MachineVariables() {
  impl_->stopped = true;
  impl_->timer.cancel();
}

void MachineVariables::change(const variables::VariableSettings& settings) {
  impl_->desk.change(settings);
}

void MachineVariables::connect(std::weak_ptr<cnc::ads::Client> client,
                               std::weak_ptr<const cnc::variables::Location> location) {
  if (impl_->way) {
    on_down("it is made anew");
  }
  impl_->break_off();
  impl_->client = std::move(client);
  impl_->location = std::move(location);
}

void MachineVariables::on_up(const std::vector<std::uint16_t>& channels) {
  const auto client = impl_->client.lock();
  const auto location = impl_->location.lock();
  if (!client || !location) {
    return;
  }
  impl_->desk.on_up(channels, impl_->now());
  if (impl_->way) {
    return;
  }
  impl_->asking = false;
  impl_->way = std::make_shared<Way>(client, *location);
}

void MachineVariables::on_down(const std::string& reason) {
  impl_->break_off();
  impl_->desk.on_down(reason, impl_->now());
  impl_->tell();
}

void MachineVariables::on_over(std::uint16_t channel) {
  if (channel == 0) {
    impl_->break_off();
  }
  impl_->desk.on_over(channel, impl_->now());
  impl_->go_on();
}

void MachineVariables::on_request(const fabric::VariableRequest& request) {
  impl_->desk.on_request(request, impl_->now());
  impl_->go_on();
}

}  // namespace millrace::gateway::live
