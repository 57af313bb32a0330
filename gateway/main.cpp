// millrace-gateway: maps the Service Interface of every channel of its machines onto the fabric.
#include <csignal>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/loop/loop.hpp"
#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "base/program/supervisor.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/profile/command_line.hpp"
#include "gateway/settings/settings.hpp"
#include "gateway/shell/check_controllers.hpp"
#include "gateway/shell/gateway.hpp"

namespace {

namespace program = millrace::base::program;
using millrace::gateway::settings::MachineSettings;
using millrace::gateway::settings::Settings;

struct Options {
  std::filesystem::path config;
  /// --check is given, with this file or none.
  bool check = false;
  std::filesystem::path checked;
  bool ask = false;
  std::vector<std::string> machines;
  std::filesystem::path journal;
  bool no_journal = false;
  spdlog::level::level_enum log_level = spdlog::level::info;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--config", options.config, "Configuration file (gateway.textproto)")
      ->type_name("FILE");
  app.add_option("--check", options.checked,
                 "Only check this configuration (default: that of --config); exit code 2 if it is "
                 "wrong")
      ->type_name("FILE")
      ->expected(0, 1);
  app.add_flag(
      "--ask", options.ask,
      "With --check: also ask the reachable controllers for each variable of data; exit code 2 if "
      "one does not exist. A gateway on this host may lose its connection for a moment");
  app.add_option("--machine", options.machines,
                 "NAME=HOST:PORT/NETID: a controller to serve; may be repeated. Without --machine "
                 "and --config: the virtual CNC on this host, as machine cnc")
      ->allow_extra_args(false);
  CLI::Option* const journal =
      app.add_option(
             "--journal", options.journal,
             "Folder of the journal, with which calls survive a restart of the gateway. "
             "Default: $STATE_DIRECTORY, else millrace/gateway-DOMAIN in $XDG_STATE_HOME or "
             "~/.local/state")
          ->type_name("DIR");
  app.add_flag("--no-journal", options.no_journal,
               "Keep no journal: when this gateway ends, calls may run twice or be lost")
      ->excludes(journal);
  program::add_log_level(app, options.log_level);
}

/// Flags win over the file.
Settings resolve(const Options& options, millrace::fabric::dds::ParticipantOptions join) {
  Settings settings;
  if (!options.config.empty()) {
    settings = millrace::gateway::settings::read_settings(options.config);
  }
  for (const std::string& text : options.machines) {
    settings.machines.push_back(millrace::gateway::settings::parse_machine(text));
  }
  if (settings.machines.empty()) {
    settings.machines.emplace_back();
  }
  millrace::gateway::settings::check_names(settings.machines);
  settings.join = std::move(join);
  if (settings.join.trust) {
    settings.join.participant_lease = millrace::fabric::dds::trusted_gateway_lease;
  }
  settings.no_journal = options.no_journal || (settings.no_journal && options.journal.empty());
  if (!options.journal.empty()) {
    settings.journal.folder = options.journal;
  }
  if (settings.no_journal) {
    settings.journal.folder.clear();
  } else if (settings.journal.folder.empty() && !options.check) {
    settings.journal.folder = millrace::gateway::settings::default_journal_folder(
        millrace::gateway::settings::StateFolders::of_environment(), settings.join.fabric,
        settings.join.domain);
  }
  return settings;
}

/// With trust a gateway may publish only the machines in its certificate; readers ignore others.
void check_machines(const std::vector<MachineSettings>& machines,
                    const millrace::fabric::dds::ParticipantOptions& join) {
  if (!join.trust) {
    return;
  }
  const auto identity =
      millrace::fabric::parse_participant_identity(join.fabric, join.trust->identity_partitions);
  for (const MachineSettings& machine : machines) {
    // Without an identity of this fabric joining fails, with its own message.
    if (identity && !identity->machines.contains(machine.name)) {
      throw program::UsageError(fmt::format(
          "the certificate of this gateway ({}) does not name the machine {}: it names {}; "
          "`millrace trust issue … --role gateway --machine {}` makes one that does",
          identity->name, machine.name,
          identity->machines.empty() ? "no machine"
                                     : fmt::format("{}", fmt::join(identity->machines, ", ")),
          machine.name));
    }
  }
}

std::string list_of(const std::vector<MachineSettings>& machines) {
  std::string words;
  for (const MachineSettings& machine : machines) {
    words += fmt::format("{}{}", words.empty() ? "" : ", ", machine.to_string());
  }
  return words;
}

void warn_of_plain_ads(const std::vector<MachineSettings>& machines, const program::Log& log) {
  for (const MachineSettings& machine : machines) {
    if (machine.is_open_to_the_network()) {
      log->warn(
          "{}: plain ADS: any host on its network can read and change the traffic; configure "
          "`secure` to prevent that (docs/how-to/secure-ads.md)",
          machine.to_string());
    }
  }
}

/// SIGHUP: reads the configuration again. A wrong one is refused and the old one stays, with an
/// alarm until a good one is read: the next start would fail.
class Reload {
 public:
  Reload(boost::asio::io_context& io, const Options& options,
         millrace::fabric::dds::ParticipantOptions join, millrace::gateway::shell::Gateway& gateway,
         program::Log log)
      : signals_(io, SIGHUP),
        options_(options),
        join_(std::move(join)),
        gateway_(gateway),
        log_(std::move(log)) {
    wait();
  }

 private:
  void wait() {
    signals_.async_wait([this](const boost::system::error_code& error, int) {
      if (!error) {
        reload();
        wait();
      }
    });
  }

  void reload() {
    if (options_.config.empty()) {
      log_->warn("SIGHUP: no configuration file to reload; start with --config to have one");
      return;
    }
    try {
      const Settings settings = resolve(options_, join_);
      check_machines(settings.machines, join_);
      gateway_.change(settings);
      log_->info("configuration {} read again: {}", options_.config.string(),
                 list_of(settings.machines));
      warn_of_plain_ads(settings.machines, log_);
    } catch (const program::UsageError& error) {
      log_->error("the configuration stays as it was: {}", error.what());
      gateway_.refuse(options_.config.string(), error.what());
    }
  }

  boost::asio::signal_set signals_;
  const Options& options_;
  const millrace::fabric::dds::ParticipantOptions join_;
  millrace::gateway::shell::Gateway& gateway_;
  program::Log log_;
};

/// A variable that a reachable controller does not have is a mistake in the configuration.
int check(const Settings& settings, bool ask) {
  fmt::print("{}\n", list_of(settings.machines));
  if (!ask) {
    return program::exit_done;
  }
  const auto asked = millrace::gateway::shell::check_controllers(settings.machines);
  for (const std::string& line : asked.silent) {
    fmt::print(stderr, "millrace-gateway: not checked: {}\n", line);
  }
  for (const std::string& line : asked.mistakes) {
    fmt::print(stderr, "millrace-gateway: {}\n", line);
  }
  return asked.mistakes.empty() ? program::exit_done : program::exit_usage;
}

/// A limit on the size of files (RLIMIT_FSIZE) is to be an error of a write, which the journal
/// handles, not the end of the gateway.
void survive_file_size_limit() {
  std::signal(SIGXFSZ, SIG_IGN);
}

int serve(const Settings& settings, const Options& options, const program::Log& log) {
  survive_file_size_limit();
  boost::asio::io_context io(1);
  boost::asio::signal_set signals(io, SIGINT, SIGTERM);
  millrace::gateway::shell::SpinAfterPublish spin;
  millrace::gateway::shell::Gateway gateway(io.get_executor(), spin, settings, log);
  const Reload reload(io, options, settings.join, gateway, log);
  const millrace::base::loop::Watchdog watchdog(io.get_executor());
  signals.async_wait([&](const boost::system::error_code&, int) {
    program::notify_supervisor("STOPPING=1");
    gateway.finish([&] { io.stop(); });
    signals.async_wait([&](const boost::system::error_code&, int) { io.stop(); });
  });
  warn_of_plain_ads(settings.machines, log);
  gateway.start();
  program::ready(fmt::format("gateway of {} on domain {}{}", list_of(settings.machines),
                             settings.join.domain,
                             settings.no_journal ? ", without a journal" : ""));
  spin.run(io, [] { return false; });
  log->info("ended by a signal");
  return program::exit_done;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Maps the Service Interface of CNC channels onto DDS request and reply topics."};
  Options options;
  add_options(app, options);
  const millrace::fabric::profile::FabricFlags fabric(app, {.name = "millrace-gateway"});
  return program::run(app, argc, argv, [&] {
    options.check = app.count("--check") > 0;
    options.config = options.checked.empty() ? options.config : options.checked;
    if (options.ask && !options.check) {
      throw program::UsageError("--ask needs --check");
    }
    if (options.check) {
      // Without the fabric: who checks the file has not the credentials of the unit.
      return check(resolve(options, {}), options.ask);
    }
    const Settings settings = resolve(options, fabric.options());
    check_machines(settings.machines, settings.join);
    return serve(settings, options, program::make_log("gateway", options.log_level));
  });
}
