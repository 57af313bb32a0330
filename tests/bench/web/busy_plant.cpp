#include "tests/bench/web/busy_plant.hpp"

#include <vector>

#include <fmt/format.h>

#include "tests/bench/event_of.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::bench {
namespace {

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
constexpr std::uint16_t machines = 20;
constexpr std::uint16_t channels = 10;
constexpr auto between_samples = std::chrono::milliseconds(100);

}  // namespace

std::string name_of_machine(std::uint16_t machine) {
  return fmt::format("press-{}", machine);
}

BusyPlant::BusyPlant(std::uint32_t domain, std::uint64_t epoch)
    : epoch_(epoch),
      tick_(io_),
      participant_({.domain = domain}),
      end_(participant_, io_.get_executor(), *this),
      data_(participant_),
      beat_(io_) {
  tell_machines();
  tell_data();
  for (std::uint16_t machine = 1; machine <= machines; ++machine) {
    for (std::uint16_t channel = 1; channel <= channels; ++channel) {
      free_.push_back({name_of_machine(machine), channel});
      tell(free_.back(), fabric::ChannelState::idle);
    }
  }
}

void BusyPlant::tell_machines() {
  for (std::uint16_t machine = 1; machine <= machines; ++machine) {
    publish(fabric::MachineStatus{.machine = name_of_machine(machine),
                                  .gateway = gateway_,
                                  .claimed = claimed_,
                                  .connected = true,
                                  .since = claimed_,
                                  .channels = channels,
                                  .host = "bench",
                                  .epoch = epoch_});
  }
}

Histogram BusyPlant::run(double seconds, double calls_per_second) {
  // Between two runs it was silent, as a gateway that hangs.
  tell_machines();
  if (!tests::run_until(io_, [this] { return instance_.has_value(); })) {
    throw std::runtime_error("no service is there");
  }
  times_ = {};
  sent_ = 0;
  calls_per_second_ = calls_per_second;
  begun_ = Clock::now();
  stop_at_ =
      begun_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  keep_going();
  if (!tests::run_until(
          io_, [this] { return Clock::now() >= stop_at_ && open_.empty(); },
          std::chrono::seconds(600))) {
    throw std::runtime_error(fmt::format("{} calls were not answered", open_.size()));
  }
  return times_;
}

void BusyPlant::on_reply(const fabric::Reply& reply) {
  const auto open = open_.find(reply.key);
  if (open == open_.end() || open->second.request.call != reply.call) {
    return;
  }
  times_.add(Clock::now() - open->second.begun);
  publish(event_of(open->second.request, fabric::EventKind::replied));
  publish(event_of(open->second.request, fabric::EventKind::written));
  tell(reply.key, fabric::ChannelState::idle);
  end_.withdraw(key_of(reply));
  open_.erase(open);
  free_.push_back(reply.key);
}

void BusyPlant::tell_data() {
  ++beats_;
  for (std::uint16_t machine = 1; machine <= machines_with_data; ++machine) {
    fabric::DataSample sample{.key = {name_of_machine(machine), 1},
                              .group = "axes",
                              .at = now(),
                              .period = between_samples,
                              .wanted = between_samples};
    for (int i = 0; i < variables; ++i) {
      sample.values.push_back({.name = fmt::format("V.A.ACT_POS.X{}", i),
                               .type = fabric::ValueType::real64,
                               .at = sample.at,
                               .elements = std::vector<double>{beats_ * 0.125 + i}});
    }
    if (const auto published = data_.publish(sample); !published) {
      throw std::runtime_error(published.error());
    }
  }
  end_.assert_machines();
  beat_.expires_after(between_samples);
  beat_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      tell_data();
    }
  });
}

void BusyPlant::keep_going() {
  const auto time = Clock::now();
  const std::chrono::duration<double> passed = time - begun_;
  while (!free_.empty() && time < stop_at_ &&
         static_cast<double>(sent_) < calls_per_second_ * passed.count()) {
    const fabric::ChannelKey key = free_.front();
    free_.pop_front();
    call(key);
  }
  if (time < stop_at_) {
    tick_.expires_after(std::chrono::milliseconds(1));
    tick_.async_wait([this](const boost::system::error_code&) { keep_going(); });
  }
}

void BusyPlant::call(const fabric::ChannelKey& key) {
  ++sent_;
  const fabric::Request request{.key = key,
                                .call = {epoch_, ++number_},
                                .assigned = *instance_,
                                .uuid = uuid,
                                .text = "2",
                                .state = 1,
                                .seen = now(),
                                .dispatched = now()};
  open_.insert_or_assign(key, Open{request, Clock::now()});
  publish(event_of(request, fabric::EventKind::seen));
  publish(event_of(request, fabric::EventKind::dispatched));
  tell(key, fabric::ChannelState::running, request.call);
  publish(request);
}

void BusyPlant::tell(const fabric::ChannelKey& key, fabric::ChannelState state,
                     fabric::CallId call) {
  fabric::ChannelStatus status{.key = key, .state = state, .since = now(), .call = call};
  if (call != fabric::CallId{}) {
    status.instance = *instance_;
    status.uuid = uuid;
  }
  end_.publish(status);
}

}  // namespace millrace::bench
