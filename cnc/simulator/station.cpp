#include "cnc/simulator/station.hpp"

#include <cassert>
#include <memory>

#include <spdlog/spdlog.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "cnc/simulator/host_files.hpp"

namespace millrace::cnc::simulator {

namespace {

/// For a client that does not read its responses.
constexpr std::chrono::seconds drain_limit{1};

std::chrono::nanoseconds steady_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

ads::ServerOptions common_options(const Setup& setup) {
  const ConnectionSettings& connections = setup.settings.connections;
  ads::ServerOptions options;
  options.session.net_id = setup.net_id;
  options.session.foreign_target = connections.foreign_target;
  options.session.routes = connections.routes;
  options.session.subscriptions.task_cycle = setup.settings.cycle;
  constexpr int behind_the_interpolator = 10;  // fraction of a cycle
  options.session.subscriptions.offset = setup.settings.cycle / behind_the_interpolator;
  options.session.subscriptions.handles = connections.max_notifications;
  options.session.subscriptions.habits = connections.notifications;
  options.notifications_survive = connections.notifications_survive;
  options.one_connection_per_address = connections.one_per_address;
  options.faults = connections.faults;
  options.max_connections = connections.max_connections;
  options.idle_time = connections.idle_time;
  return options;
}

ads::ServerOptions plain_options(const Setup& setup) {
  ads::ServerOptions options = common_options(setup);
  options.address = setup.listen.host;
  options.tcp_port = setup.listen.port;
  return options;
}

/// Valid for ten years; used until this process ends.
void make_certificate(ads::ServerSelfSigned& to) {
  using base::openssl::Key;
  constexpr auto validity = std::chrono::years(10);
  const Key key = Key::generate_rsa();
  const auto now =
      std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  const base::openssl::Subject subject{.organisation = "millrace",
                                       .common_name = "millrace-cnc",
                                       .from = now - std::chrono::days(1),
                                       .until = now + std::chrono::seconds(validity)};
  to.key = key.pem();
  to.certificate = base::openssl::self_signed(key, subject).pem();
}

std::string fingerprint_of(const std::string& certificate) {
  const auto read = base::openssl::Certificate::read(certificate);
  return read ? read->fingerprint() : "none";
}

/// What discovery reports about this CNC.
ads::Identity identity_of(const Setup& setup, const ads::ServerSecurity& security) {
  ads::Identity identity;
  identity.net_id = setup.net_id;
  identity.name = setup.settings.discovery->name;
  if (security.self_signed) {
    identity.fingerprint = fingerprint_of(security.self_signed->certificate);
  } else if (security.shared_ca) {
    identity.fingerprint = fingerprint_of(security.shared_ca->certificate);
  }
  return identity;
}

ads::ServerOptions secure_options(const Setup& setup, const base::program::Log& log) {
  const SecureAdsSettings& secure = *setup.settings.secure_ads;
  ads::ServerOptions options = common_options(setup);
  options.address = secure.listen.host;
  options.tcp_port = secure.listen.port;
  options.security = secure.security;
  if (auto& self_signed = options.security->self_signed) {
    if (self_signed->certificate.empty()) {
      make_certificate(*self_signed);
    }
    log->info("Secure ADS: the fingerprint of our certificate is {}",
              fingerprint_of(self_signed->certificate));
  }
  options.secure_faults = secure.faults;
  return options;
}

}  // namespace

Station::Station(const boost::asio::any_io_executor& executor, const Setup& setup, Panel& panel,
                 const base::program::Log& log)
    : panel_(panel),
      log_(log),
      folders_(setup.settings.folders),
      machine_(setup.settings,
               {.clock = steady_now,
                .programs = folders_,
                .on_answered = [this](std::uint32_t channel,
                                      const AnsweredCall& call) { panel_.remember(channel, call); },
                .on_command = [this] { cycle_.wake(); }}),
      device_(machine_),
      symbol_names_(machine_, device_.catalogue()),
      with_symbols_(device_, symbol_names_),
      with_sums_(named_device(setup.settings)),
      cycle_(executor, setup.settings.cycle,
             [this](std::chrono::nanoseconds now) { return advance(now); }) {
  ads::Device& device = served_device(setup.settings);
  const auto& secure = setup.settings.secure_ads;
  const auto& discovery = setup.settings.discovery;
  const auto routes = read_routes(secure ? secure->routes_file : std::filesystem::path(), log);
  if (!secure || !secure->only) {
    ads::ServerOptions options = plain_options(setup);
    options.routes = discovery ? routes : nullptr;
    plain_.emplace(executor, device, std::move(options), log);
  }
  ads::ServerSecurity shown;
  if (secure) {
    ads::ServerOptions options = secure_options(setup, log);
    options.routes = routes;
    shown = *options.security;
    secure_.emplace(executor, device, std::move(options), log);
  }
  if (discovery) {
    discovery_.emplace(executor,
                       ads::DiscoveryOptions{discovery->listen.host, discovery->listen.port,
                                             identity_of(setup, shown), discovery->user,
                                             discovery->password, routes},
                       log);
  }
}

ads::Device& Station::named_device(const Settings& settings) {
  if (settings.connections.symbols) {
    return with_symbols_;
  }
  return device_;
}

ads::Device& Station::served_device(const Settings& settings) {
  return settings.connections.sum_commands ? with_sums_ : named_device(settings);
}

void Station::start(const std::vector<Run>& runs, const std::vector<Program>& programs) {
  assert(runs.size() == programs.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (const auto started = machine_.channel(runs[i].channel)->start(programs[i]); !started) {
      panel_.show_mistakes(runs[i].channel, started.error());
    }
  }
  cycle_.wake();
}

void Station::drain(std::function<void()> done) {
  const auto servers = std::make_shared<int>(plain_ && secure_ ? 2 : 1);
  const auto drained = [this, servers, done = std::move(done)](bool all) {
    if (!all) {
      log_->warn("a client has not read all its responses within {} s; the rest is lost",
                 drain_limit.count());
    }
    if (--*servers == 0) {
      done();
    }
  };
  for (auto* const server : {&plain_, &secure_}) {
    if (*server) {
      (*server)->drain(drain_limit, drained);
    }
  }
}

bool Station::advance(std::chrono::nanoseconds now) {
  for (const NcEvent& happening : machine_.tick(now)) {
    if (const auto shown = panel_.show(happening); !shown) {
      // As the CNC does with a file that it cannot write; the NC program may have ended already.
      if (auto aborted = machine_.channel(happening.channel)->program().abort({0, shown.error()})) {
        (void)panel_.show({happening.channel, *std::move(aborted)});
      }
    }
  }
  if (!machine_.active()) {
    on_idle_();
  }
  return machine_.active();
}

}  // namespace millrace::cnc::simulator
