// millrace-cnc: a virtual CNC without a physical machine. It serves the ADS objects of a controller
// and runs NC programs, so that services and gateways can be built and tested without a controller.
#include <cassert>
#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "cnc/ads/discovery_server.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/simulator/cycle.hpp"
#include "cnc/simulator/host_files.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/symbol_names.hpp"
#include "cnc/simulator/options.hpp"
#include "cnc/simulator/panel.hpp"
#include "cnc/simulator/virtual_device.hpp"

namespace millrace::cnc::simulator {

namespace {

namespace program = base::program;

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

/// A virtual CNC on its host: the machine with its ADS server, its cycle and its operator's panel.
class Station {
 public:
  /// The panel must outlive the station. Throws std::runtime_error if it cannot listen.
  Station(const boost::asio::any_io_executor& executor, const Setup& setup, Panel& panel,
          const base::program::Log& log);
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// TCP ports of plain and of Secure ADS; nullopt if not served.
  [[nodiscard]] std::optional<std::uint16_t> plain_port() const { return port_of(plain_); }
  [[nodiscard]] std::optional<std::uint16_t> secure_port() const { return port_of(secure_); }
  /// UDP port.
  [[nodiscard]] std::optional<std::uint16_t> discovery_port() const {
    return discovery_ ? std::optional(discovery_->port()) : std::nullopt;
  }
  [[nodiscard]] bool active() const { return machine_.active(); }
  [[nodiscard]] const CycleCounts& cycles() const { return cycle_.counts(); }
  /// Sets the handler that is called after each cycle without an active NC program: when the last
  /// one has ended, and after a command that starts none.
  void on_idle(std::function<void()> handler) { on_idle_ = std::move(handler); }
  /// Calls `done` once clients have the responses to all their requests so far, or after one
  /// second: a client may not read them.
  void drain(std::function<void()> done);
  /// Starts each program in the channel of the run with the same index; the panel shows the
  /// mistakes of those that cannot be started.
  void start(const std::vector<Run>& runs, const std::vector<Program>& programs);

 private:
  /// The device with its symbols, if it has any.
  ads::Device& named_device(const Settings& settings);
  ads::Device& served_device(const Settings& settings);
  static std::optional<std::uint16_t> port_of(const std::optional<ads::Server>& server) {
    return server ? std::optional(server->tcp_port()) : std::nullopt;
  }
  /// Runs one cycle; true while more are needed.
  bool advance(std::chrono::nanoseconds now);

  Panel& panel_;
  base::program::Log log_;
  std::function<void()> on_idle_ = [] {};
  ProgramFolders folders_;
  Machine machine_;
  VirtualDevice device_;
  objects::SymbolNames symbol_names_;
  ads::Symbols with_symbols_;
  ads::SumCommands with_sums_;
  std::optional<ads::Server> plain_;
  std::optional<ads::Server> secure_;
  std::optional<ads::DiscoveryServer> discovery_;
  Cycle cycle_;
};

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

/// --check: prints every mistake with its place.
int check_programs(const std::vector<std::filesystem::path>& files) {
  bool mistakes = false;
  for (const auto& file : files) {
    const Program program = program::must(read_program(file));
    for (const nc::Diagnostic& mistake : nc::check(program.file, program.text)) {
      fmt::print("{}\n", mistake.to_string());
      mistakes = true;
    }
  }
  return mistakes ? program::exit_failed : program::exit_done;
}

/// If a file cannot be read, no program starts.
std::vector<Program> read_programs(const std::vector<Run>& runs) {
  std::vector<Program> programs;
  for (const Run& run : runs) {
    auto program = read_program(run.file);
    if (!program) {
      throw program::UsageError(
          fmt::format("--run {}={}: {}", run.channel, run.file.string(), program.error()));
    }
    programs.push_back(std::move(*program));
  }
  return programs;
}

/// For example " on 127.0.0.1:48898, Secure ADS at 127.0.0.1:8016".
std::string addresses_of(const Station& station, const Setup& setup) {
  std::string addresses;
  if (const auto port = station.plain_port()) {
    addresses = fmt::format(" on {}:{}", setup.listen.host, *port);
  }
  if (const auto port = station.secure_port()) {
    addresses +=
        fmt::format(", Secure ADS at {}:{}", setup.settings.secure_ads->listen.host, *port);
  }
  if (const auto port = station.discovery_port()) {
    addresses += fmt::format(", discovery at {}:{}", setup.settings.discovery->listen.host, *port);
  }
  return addresses;
}

int serve(const Options& options) {
  const Setup setup = resolve(options);
  const std::vector<Program> programs = read_programs(setup.runs);
  const auto log = program::make_log("cnc", options.log_level);

  boost::asio::io_context io(1);
  Panel panel(log, ReportFiles(options.folder), options.timings);
  Station station(io.get_executor(), setup, panel, log);
  if (options.exit_when_idle) {
    station.on_idle([&] {
      // The response to the write that released a program is sent after the program's end.
      station.drain([&] {
        if (!station.active()) {
          io.stop();
        }
      });
    });
  }
  boost::asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&](const boost::system::error_code&, int) { io.stop(); });

  program::ready(fmt::format("virtual CNC {}{}, {} channel{}", setup.net_id.to_string(),
                             addresses_of(station, setup), setup.settings.channels,
                             setup.settings.channels == 1 ? "" : "s"));
  station.start(setup.runs, programs);
  io.run();

  panel.print_timings();
  panel.report_cycles(station.cycles());
  if (options.exit_when_idle && station.active()) {
    log->error("ended by a signal while a program was still running");
    return program::exit_failed;
  }
  return options.exit_when_idle && panel.failed() ? program::exit_failed : program::exit_done;
}

}  // namespace

}  // namespace millrace::cnc::simulator

int main(int argc, char** argv) {
  using namespace millrace::cnc::simulator;
  CLI::App app{"A virtual CNC: serves the ADS objects of a controller and runs NC programs."};
  Options options;
  add_options(app, options);
  return millrace::base::program::run(app, argc, argv, [&] {
    return options.check.empty() ? serve(options) : check_programs(options.check);
  });
}
