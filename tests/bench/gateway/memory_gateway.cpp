#include "tests/bench/gateway/memory_gateway.hpp"

#include <cassert>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/endpoints/call_endpoint.hpp"
#include "gateway/core/core.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/shell/spin_after_publish.hpp"
#include "gateway/shell/wake_timer.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/service_interface.hpp"
#include "tests/support/silent_link.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::bench {

namespace {

namespace asio = boost::asio;
using namespace millrace::gateway;

}  // namespace

struct MemoryGateway::Impl final : fabric::endpoints::CallEndpointListener,
                                   core::Fabric,
                                   core::Host {
  explicit Impl(const MemoryPlant& own_plant)
      : plant(own_plant),
        journal(journal::in_memory(io.get_executor())),
        core(*this, *this, options_of(plant, *journal), journal->state()),
        places(plant.machines.size() * plant.channels + 1),
        timer(io.get_executor(), [this] { core.on_time(); }),
        participant({.domain = plant.domain, .configuration = dds_configuration(plant.interface)}),
        end(participant, io.get_executor(), *this) {
    for (std::size_t i = 0; i < plant.machines.size(); ++i) {
      before[plant.machines[i]] = i * plant.channels;
    }
    on_readers(false, false);
    journal->on_recorded([this](const Ticket& ticket) { core.on_recorded(ticket); });
    core.start();
    run([&] { return up == plant.machines.size(); });
  }

  static core::CoreOptions options_of(const MemoryPlant& plant, const journal::Journal& journal) {
    core::CoreOptions options{
        .own = {.id = fabric::InstanceId::random(), .epoch = journal.state().numbers().epoch},
        .lease = std::chrono::seconds(2)};
    for (const std::string& machine : plant.machines) {
      options.machines.push_back(
          {.name = machine, .intervals = {.idle = plant.idle}, .watch = SubscriptionMode::poll});
    }
    return options;
  }

  /// Its index among the channels of all machines, from 1.
  [[nodiscard]] std::size_t index_of(const fabric::ChannelKey& key) const {
    return key.channel + (plant.machines.size() == 1 ? 0 : before.at(key.machine));
  }

  struct Place {
    tests::ServiceInterface variables;
    Clock::time_point asked;
    Clock::time_point seen;
    std::uint32_t number = 0;
  };

  void ask(std::size_t channel) {
    if (to_start == 0) {
      return;
    }
    --to_start;
    Place& place = places[channel];
    place.asked = Clock::now();
    const std::string& uuid = plant.uuids == 0 ? bench_uuid : uuids[channel % plant.uuids];
    place.variables.call({uuid, "2.0000000000", ++place.number});
  }

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    instances.insert_or_assign(instance.id, instance);
    core.on_instance_ready(instance);
  }
  void on_instance_changed(const fabric::InstanceIdentity& instance) override {
    core.on_instance_ready(instance);
  }
  void on_instance_gone(const fabric::InstanceId& instance) override {
    ++lost;
    instances.erase(instance);
    core.on_instance_gone(instance);
  }
  void on_load(const fabric::InstanceLoad& load) override { core.on_load(load); }
  void on_reply(const fabric::Reply& reply) override {
    if (reply.kind == fabric::ReplyKind::final) {
      result.replied.add(Clock::now() - places[index_of(reply.key)].seen);
    }
    core.on_reply(reply);
  }
  void on_readers(bool of_channels, bool of_events) override {
    core.set_readers({of_events, of_channels, Level::warn});
  }

  /// A link to a controller in this process.
  class MemoryLink final : public tests::SilentLink {
   public:
    MemoryLink(Impl& gateway, std::string machine)
        : gateway_(gateway), machine_(std::move(machine)) {}
    void read(std::uint16_t channel, ReadSet set) override {
      asio::post(gateway_.io, [&gateway = gateway_, key = key_of(channel), set] {
        gateway.core.on_read(key, gateway.places[gateway.index_of(key)].variables.read(set));
      });
    }
    void write(std::uint16_t channel, Variable variable, const Value& value) override {
      asio::post(gateway_.io, [&gateway = gateway_, key = key_of(channel), variable, value] {
        gateway.write(key, variable, value);
      });
    }

   private:
    [[nodiscard]] fabric::ChannelKey key_of(std::uint16_t channel) const {
      return {machine_, channel};
    }

    Impl& gateway_;
    std::string machine_;
  };

  void write(const fabric::ChannelKey& key, Variable variable, const Value& value) {
    Place& place = places[index_of(key)];
    place.variables.write(variable, value);
    if (variable == Variable::response_state) {
      result.released.add(Clock::now() - place.asked);
      ++finished;
      ask(index_of(key));
    }
    core.on_write(key, WriteOutcome::written, "");
  }

  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings& machine) override {
    asio::post(io, [this, name = machine.name] {
      std::vector<std::uint16_t> numbers(plant.channels);
      std::iota(numbers.begin(), numbers.end(), std::uint16_t{1});
      core.on_link_up(name, numbers);
      ++up;
    });
    return std::make_unique<MemoryLink>(*this, machine.name);
  }
  void append(const JournalEntry& entry, const Ticket& ticket) override {
    if (const auto* dispatched = std::get_if<DispatchedEntry>(&entry)) {
      // In the same step as the acceptance.
      places[index_of(dispatched->key)].seen = Clock::now();
    }
    journal->append(entry, ticket);
  }
  void log(Level, const std::string&) override {}
  void set_alarm(const fabric::AlarmKey&, const fabric::Message&, const fabric::Message&) override {
  }
  void may_end(bool) override {}
  [[nodiscard]] Moment now() const override {
    return {Clock::now(), std::chrono::time_point_cast<std::chrono::nanoseconds>(
                              std::chrono::system_clock::now())};
  }
  void wake_at(std::optional<SteadyTime> time) override { timer.set(time); }

  void publish(const fabric::Request& request) override {
    given_at = Clock::now();
    given_to = request.assigned;
    given_attempt = request.attempt;
    static_cast<void>(end.publish(request));
    if (attentive) {
      spin.expect();
    }
  }
  void publish(const fabric::Event& event) override { static_cast<void>(end.publish(event)); }
  void publish(const fabric::ChannelStatus& status) override { end.publish(status); }
  void publish(const fabric::MachineStatus&) override {}
  void publish(const fabric::DataSample&) override {}
  void publish(const fabric::ProgramEvent&) override {}
  void publish(const fabric::InstanceId&, const fabric::VariableReply&) override {}
  void publish(const fabric::Outcome&) override {}
  void dispose(const fabric::RequestKey& request) override { end.withdraw(request); }
  void dispose(const fabric::ChannelKey&) override {}
  void dispose(const fabric::MachineStatus&) override {}
  void dispose(const fabric::DataSample&) override {}
  [[nodiscard]] bool awaits_authentication() const override { return false; }
  void subscribe_channels() override {}

  void run(const std::function<bool()>& done) {
    io.restart();
    spin.run(io, done);
    assert(done() && "the loop has nothing left to do");
  }
  bool run(const std::function<bool()>& done, std::chrono::milliseconds limit) {
    bool over = false;
    asio::steady_timer alarm(io, limit);
    alarm.async_wait([&over](boost::system::error_code) { over = true; });
    run([&] { return over || done(); });
    const bool reached = !over || done();
    // The coroutine that waits for the timer refers to `over`: let it end here.
    alarm.cancel();
    run([&] { return over; });
    return reached;
  }

  MemoryPlant plant;
  std::size_t calling_machines = plant.machines.size();
  const std::vector<std::string> uuids = numbered_uuids(plant.uuids);
  /// The number of channels of the machines before each.
  std::map<std::string, std::size_t> before;
  asio::io_context io{1};
  std::unique_ptr<journal::Journal> journal;
  core::Core core;
  bool attentive = true;
  shell::SpinAfterPublish spin;
  std::vector<Place> places;
  shell::WakeTimer timer;
  std::map<fabric::InstanceId, fabric::InstanceIdentity> instances;
  Result result;
  /// The number of links that are up.
  std::size_t up = 0;
  std::size_t to_start = 0;
  std::size_t finished = 0;
  std::size_t lost = 0;
  Clock::time_point given_at;
  fabric::InstanceId given_to;
  std::uint32_t given_attempt = 0;
  fabric::dds::Participant participant;
  fabric::endpoints::CallEndpoint end;
};

MemoryGateway::MemoryGateway(const MemoryPlant& plant) : impl_(std::make_unique<Impl>(plant)) {}
MemoryGateway::MemoryGateway(std::uint32_t domain, std::size_t channels, std::size_t active,
                             std::chrono::milliseconds idle)
    : MemoryGateway(
          MemoryPlant{.domain = domain, .channels = channels, .active = active, .idle = idle}) {}
MemoryGateway::~MemoryGateway() = default;

void MemoryGateway::await_instances(std::size_t count) {
  impl_->run([&] { return impl_->instances.size() >= count; });
}

void MemoryGateway::begin(std::size_t calls) {
  impl_->result = {};
  impl_->finished = 0;
  impl_->to_start = calls;
  const MemoryPlant& plant = impl_->plant;
  for (std::size_t machine = 0; machine < impl_->calling_machines; ++machine) {
    for (std::size_t channel = 1; channel <= plant.active; ++channel) {
      impl_->ask(machine * plant.channels + channel);
    }
  }
}

void MemoryGateway::call_on_one_channel() {
  impl_->calling_machines = 1;
  impl_->plant.active = 1;
}

void MemoryGateway::doze() {
  impl_->attentive = false;
}

MemoryGateway::Result MemoryGateway::run(std::size_t calls) {
  return std::move(*run_within(calls, std::chrono::hours(24)));
}

std::optional<MemoryGateway::Result> MemoryGateway::run_within(std::size_t calls,
                                                               std::chrono::milliseconds limit) {
  begin(calls);
  const double before = own_processor_microseconds();
  const auto start = Clock::now();
  if (!impl_->run([&] { return impl_->finished >= calls; }, limit)) {
    return std::nullopt;
  }
  const std::chrono::duration<double> took = Clock::now() - start;
  impl_->result.calls_per_second = static_cast<double>(calls) / took.count();
  impl_->result.microseconds_per_call =
      (own_processor_microseconds() - before) / static_cast<double>(calls);
  return std::move(impl_->result);
}

void MemoryGateway::run_until(const std::function<bool()>& done) {
  impl_->run(done);
}
bool MemoryGateway::run_until(const std::function<bool()>& done, std::chrono::milliseconds limit) {
  return impl_->run(done, limit);
}
std::size_t MemoryGateway::instances() const {
  return impl_->instances.size();
}
std::size_t MemoryGateway::lost() const {
  return impl_->lost;
}
Clock::time_point MemoryGateway::given_at() const {
  return impl_->given_at;
}
fabric::InstanceId MemoryGateway::given_to() const {
  return impl_->given_to;
}
std::uint32_t MemoryGateway::given_attempt() const {
  return impl_->given_attempt;
}
std::uint32_t MemoryGateway::pid_of(const fabric::InstanceId& instance) const {
  return impl_->instances.at(instance).pid;
}

void MemoryGateway::withdraw() {
  impl_->to_start = 0;
  for (auto& place : impl_->places) {
    place.variables.set_request_state(0);
  }
}

}  // namespace millrace::bench
