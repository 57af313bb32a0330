#include "gateway/machines.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "gateway/claims.hpp"
#include "gateway/machine_report.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway {

namespace {

namespace asio = boost::asio;
using Channels = std::vector<std::uint16_t>;

/// How long a gateway listens for others before it serves: discovery takes some 10 ms on a quiet
/// host.
constexpr std::chrono::milliseconds listen_time{300};
constexpr std::chrono::seconds load_period{1};

std::string address_of(const MachineSettings& settings) {
  constexpr std::size_t most = 127;
  return fmt::format("{}:{}, {}", settings.host, settings.tcp_port, settings.net_id.to_string())
      .substr(0, most);
}

bool same_way(const MachineSettings& a, const MachineSettings& b) {
  return a.host == b.host && a.tcp_port == b.tcp_port && a.net_id == b.net_id &&
         a.source == b.source && a.channels == b.channels;
}

/// Whether `more` claims a channel that `less` does not; none = all.
bool claims_more(const Channels& more, const Channels& less) {
  return !less.empty() && (more.empty() || std::ranges::any_of(more, [&](std::uint16_t channel) {
                             return std::ranges::find(less, channel) == less.end();
                           }));
}

/// Had the call been given to an instance, or may it have been?
bool under_way(const fabric::ChannelStatus& status) {
  using enum fabric::ChannelState;
  return status.attempt > 0 || status.state == running || status.state == held ||
         status.state == answering;
}

/// One machine of the configuration.
struct One {
  MachineSettings settings;
  MachineReport report;
  asio::steady_timer listening;
  bool listens = false;
  /// It may have served already; then its claim is not moved behind those of others.
  bool has_served = false;
  std::unique_ptr<MachineLink> link{};
  bool up = false;
  /// What the controller has, while the link is up.
  Channels found{};
  std::set<std::uint16_t> served{};
  /// The configuration names it no more.
  bool leaving = false;
  /// Who serves it in our place, as it was logged last.
  std::string refusal{};
};

}  // namespace

struct Machines::Impl final : LinkEvents, std::enable_shared_from_this<Impl> {
  Impl(asio::any_io_executor the_executor, GatewayIdentity the_own, MachinesListener& the_listener,
       std::function<Moment()> the_clock, idl::program::Log the_log)
      : executor(std::move(the_executor)),
        own(std::move(the_own)),
        listener(the_listener),
        clock(std::move(the_clock)),
        log(std::move(the_log)),
        claims(own.id),
        load_timer(executor) {}

  // What the links say. The clock comes first: it may find that this process stood still and take
  // the very link away that speaks.
  void on_link_up(const std::string& machine, const Channels& channels) override {
    if (One* one = linked(machine)) {
      one->up = true;
      one->found = channels;
      serve(*one);
    }
  }
  void on_link_down(const std::string& machine, const std::string& reason) override {
    if (One* one = linked(machine)) {
      one->up = false;
      one->served.clear();
      if (one->refusal.empty()) {
        one->report.on_down(reason, clock());
      }
      listener.on_link_down(machine, reason);
      publish(*one);
    }
  }
  void on_read(const fabric::ChannelKey& key, const Picture& picture) override {
    if (linked(key.machine) != nullptr) {
      listener.on_read(key, picture);
    }
  }
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override {
    if (linked(key.machine) != nullptr) {
      listener.on_read_failed(key, reason);
    }
  }
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override {
    if (linked(key.machine) != nullptr) {
      listener.on_write(key, outcome, reason);
    }
  }
  One* linked(const std::string& machine) {
    clock();
    One& one = machines.at(machine);
    return one.link ? &one : nullptr;
  }

  void set(const std::vector<MachineSettings>& wanted);
  One& add(const MachineSettings& settings);
  void change(One& one, const MachineSettings& settings);
  void listen(One& one);
  void review(const std::string& machine);
  bool refused_by_all(One& one);
  void serve(One& one);
  void connect(One& one);
  void drop_link(One& one, const std::string& reason);
  void refuse(const One& one, std::uint16_t channel, const std::string& reason);
  void inherit(const fabric::ChannelKey& key);
  void publish(One& one);
  void tick();

  asio::any_io_executor executor;
  GatewayIdentity own;
  MachinesListener& listener;
  std::function<Moment()> clock;
  idl::program::Log log;
  Claims claims;
  std::map<std::string, One> machines;
  /// What channels of contested machines showed last, while others served them.
  std::map<fabric::ChannelKey, fabric::ChannelStatus> last_seen;
  /// The gateway that left each machine last.
  std::map<std::string, std::string> predecessors;
  asio::steady_timer load_timer;
};

void Machines::Impl::set(const std::vector<MachineSettings>& wanted) {
  std::set<std::string> names;
  for (const MachineSettings& settings : wanted) {
    names.insert(settings.name);
    const auto found = machines.find(settings.name);
    if (found == machines.end()) {
      listen(add(settings));
    } else {
      change(found->second, settings);
    }
  }
  for (auto& [name, one] : machines) {
    if (!names.contains(name) && !one.leaving) {
      log->info("{}: not in the configuration any more", one.settings.to_string());
      one.leaving = true;
      for (const std::uint16_t channel : listener.channels_of(name)) {
        listener.on_retired({name, channel});
      }
      asio::post(executor, [weak = weak_from_this(), machine = name] {
        if (const auto self = weak.lock()) {
          self->review(machine);
        }
      });
    }
  }
}

One& Machines::Impl::add(const MachineSettings& settings) {
  fabric::MachineStatus status;
  status.machine = settings.name;
  status.gateway = own.id;
  status.claimed = clock().wall;
  status.claims = settings.channels;
  status.address = address_of(settings);
  status.poll = settings.pace.idle;
  status.host = own.host;
  status.pid = own.pid;
  status.version = own.version;
  status.epoch = own.epoch;
  return machines
      .emplace(settings.name,
               One{settings, MachineReport(std::move(status)), asio::steady_timer(executor)})
      .first->second;
}

void Machines::Impl::change(One& one, const MachineSettings& settings) {
  const bool same = same_way(one.settings, settings);
  const bool more = one.leaving || claims_more(settings.channels, one.settings.channels);
  one.settings = settings;
  one.leaving = false;
  one.report.set_poll(settings.pace.idle);
  one.report.set_address(address_of(settings));
  if (same && !more) {
    publish(one);
    return;
  }
  one.report.claim(more ? clock().wall : one.report.status().claimed, settings.channels);
  log->info("{}: the configuration has changed", settings.to_string());
  drop_link(one, "the configuration has changed");
  for (const std::uint16_t channel : listener.channels_of(settings.name)) {
    if (!settings.channels.empty() &&
        std::ranges::find(settings.channels, channel) == settings.channels.end()) {
      listener.on_retired({settings.name, channel});
    }
  }
  if (!one.listens) {
    review(settings.name);
  }
}

void Machines::Impl::listen(One& one) {
  one.listens = true;
  one.report.on_down("listening whether another gateway serves this machine", clock());
  publish(one);
  one.listening.expires_after(listen_time);
  one.listening.async_wait(
      [weak = weak_from_this(), machine = one.settings.name](boost::system::error_code error) {
        const auto self = weak.lock();
        if (error || !self || !self->machines.contains(machine)) {
          return;
        }
        self->clock();
        One& it = self->machines.at(machine);
        it.listens = false;
        if (!it.has_served) {
          const auto claimed =
              self->claims.behind_those_that_serve(machine, it.report.status().claimed);
          it.report.claim(claimed, it.settings.channels);
        }
        self->review(machine);
      });
}

void Machines::Impl::review(const std::string& machine) {
  const auto found = machines.find(machine);
  if (found == machines.end() || found->second.listens) {
    return;
  }
  One& one = found->second;
  if (one.leaving && listener.channels_of(machine).empty()) {
    const fabric::MachineStatus last = one.report.status();
    machines.erase(found);
    listener.on_machine_left(last);
    return;
  }
  if (!one.leaving && refused_by_all(one)) {
    // A call whose answer is half written is brought to its end all the same.
    if (listener.channels_of(machine).empty()) {
      drop_link(one, one.refusal);
    } else if (!one.link) {
      connect(one);
    }
    publish(one);
    return;
  }
  if (!one.link) {
    connect(one);
  } else if (one.up) {
    serve(one);
  }
  publish(one);
}

bool Machines::Impl::refused_by_all(One& one) {
  const std::string& name = one.settings.name;
  const auto* other = claims.ahead_of_all(name, one.settings.channels, one.report.status().claimed);
  if (other == nullptr) {
    if (!one.refusal.empty()) {
      log->warn("{}: taken over: {} is gone", one.settings.to_string(), predecessors[name]);
      one.refusal.clear();
    }
    return false;
  }
  const std::string refusal =
      fmt::format("{} serves it already; this gateway stands by", name_of(*other));
  if (one.refusal != refusal) {
    one.refusal = refusal;
    log->warn("{}: {}", one.settings.to_string(), refusal);
  }
  for (const std::uint16_t channel : listener.channels_of(name)) {
    refuse(one, channel, refusal);
  }
  one.served.clear();
  one.report.on_down(refusal, clock());
  return true;
}

void Machines::Impl::refuse(const One& one, std::uint16_t channel, const std::string& reason) {
  listener.on_refused({one.settings.name, channel}, reason);
}

void Machines::Impl::serve(One& one) {
  const std::string& name = one.settings.name;
  Channels ours;
  std::string refused;
  for (const std::uint16_t channel : one.leaving || !one.refusal.empty() ? Channels{} : one.found) {
    const fabric::ChannelKey key{name, channel};
    const auto* other = claims.ahead(key, one.report.status().claimed);
    if (other == nullptr) {
      ours.push_back(channel);
      continue;
    }
    const std::string reason =
        fmt::format("channel {} is served by {} already", channel, name_of(*other));
    refused += fmt::format("{}{}", refused.empty() ? "" : "; ", reason);
    refuse(one, channel, reason);
  }
  if (!refused.empty() && refused != one.report.status().reason) {
    log->warn("{}: {}; this gateway stands by for it", one.settings.to_string(), refused);
  }
  for (const std::uint16_t channel : ours) {
    if (!one.served.contains(channel)) {
      inherit({name, channel});
    }
  }
  one.served = {ours.begin(), ours.end()};
  one.has_served = one.has_served || !ours.empty();
  if (one.refusal.empty()) {
    one.report.on_up(ours.size(), refused, clock());
  }
  listener.on_link_up(name, ours);
  publish(one);
}

void Machines::Impl::inherit(const fabric::ChannelKey& key) {
  const auto left = last_seen.extract(key);
  if (!left.empty() && under_way(left.mapped())) {
    listener.on_inherited(left.mapped(), predecessors[key.machine]);
  }
}

void Machines::Impl::connect(One& one) {
  one.link = std::make_unique<MachineLink>(executor, one.settings, *this, log);
  if (one.refusal.empty()) {
    one.report.on_down("connecting", clock());
  }
  one.link->start();
}

void Machines::Impl::drop_link(One& one, const std::string& reason) {
  if (!one.link) {
    return;
  }
  one.link.reset();
  one.up = false;
  one.served.clear();
  listener.on_link_dropped(one.settings.name, reason);
}

void Machines::Impl::publish(One& one) {
  if (const auto news = one.report.news()) {
    listener.on_machine_status(*news);
  }
}

void Machines::Impl::tick() {
  load_timer.expires_after(load_period);
  load_timer.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    const auto self = weak.lock();
    if (error || !self) {
      return;
    }
    for (auto& [name, one] : self->machines) {
      one.report.on_load(one.link ? one.link->load() : LinkLoad{}, self->clock().steady);
      self->publish(one);
    }
    self->tick();
  });
}

Machines::Machines(asio::any_io_executor executor, GatewayIdentity own, MachinesListener& listener,
                   std::function<Moment()> clock, idl::program::Log log)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(own), listener, std::move(clock),
                                   std::move(log))) {
  impl_->tick();
}

Machines::~Machines() = default;

void Machines::set(const std::vector<MachineSettings>& machines) {
  impl_->clock();
  impl_->set(machines);
}

void Machines::on_machine(const fabric::MachineStatus& status) {
  if (status.gateway == impl_->own.id) {
    return;
  }
  impl_->clock();
  impl_->claims.set(status);
  if (impl_->machines.contains(status.machine)) {
    impl_->listener.on_contested();
    impl_->review(status.machine);
  }
}

void Machines::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) {
  if (gateway == impl_->own.id) {
    return;
  }
  impl_->clock();
  if (const auto* gone = impl_->claims.find(machine, gateway)) {
    impl_->predecessors[machine] = name_of(*gone);
  }
  impl_->claims.remove(machine, gateway);
  impl_->review(machine);
}

void Machines::on_channel(const fabric::ChannelStatus& status) {
  const auto machine = impl_->machines.find(status.key.machine);
  // Our own words are heard too.
  if (machine != impl_->machines.end() && !machine->second.served.contains(status.key.channel)) {
    impl_->last_seen.insert_or_assign(status.key, status);
  }
}

void Machines::on_over(const fabric::ChannelKey& key) {
  asio::post(impl_->executor, [weak = std::weak_ptr(impl_), machine = key.machine] {
    if (const auto self = weak.lock()) {
      self->clock();
      self->review(machine);
    }
  });
}

bool Machines::stood_still() {
  bool contested = false;
  for (auto& [name, one] : impl_->machines) {
    if (impl_->claims.contested(name)) {
      contested = true;
      if (one.link) {
        impl_->drop_link(one, "this gateway stood still");
        impl_->listen(one);
      }
    }
  }
  return contested;
}

void Machines::read(const fabric::ChannelKey& key, Look look) {
  impl_->machines.at(key.machine).link->read(key.channel, look);
}

void Machines::write(const fabric::ChannelKey& key, Variable variable, const Value& value) {
  impl_->machines.at(key.machine).link->write(key.channel, variable, value);
}

}  // namespace millrace::gateway
