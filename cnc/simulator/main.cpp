// millrace-cnc: a virtual CNC without a physical machine. It serves the ADS objects of a controller
// and runs NC programs, so that services and gateways can be built and tested without a controller.
#include <csignal>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "cnc/simulator/host_files.hpp"
#include "cnc/simulator/options.hpp"
#include "cnc/simulator/panel.hpp"
#include "cnc/simulator/station.hpp"

namespace {

using namespace millrace::cnc;
using namespace millrace::cnc::simulator;
using namespace millrace::base::program;

/// --check: prints every mistake with its place.
int check_programs(const std::vector<std::filesystem::path>& files) {
  bool mistakes = false;
  for (const auto& file : files) {
    const auto program = read_program(file);
    if (!program) {
      throw UsageError(program.error());
    }
    for (const nc::Diagnostic& mistake : nc::check(program->file, program->text)) {
      fmt::print("{}\n", mistake.to_string());
      mistakes = true;
    }
  }
  return mistakes ? exit_failed : exit_done;
}

/// If a file cannot be read, no program starts.
std::vector<Program> read_programs(const std::vector<Run>& runs) {
  std::vector<Program> programs;
  for (const Run& run : runs) {
    auto program = read_program(run.file);
    if (!program) {
      throw UsageError(
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
  const auto log = make_log("cnc", options.log_level);

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

  ready(fmt::format("virtual CNC {}{}, {} channel{}", setup.net_id.to_string(),
                    addresses_of(station, setup), setup.settings.channels,
                    setup.settings.channels == 1 ? "" : "s"));
  station.start(setup.runs, programs);
  io.run();

  panel.print_timings();
  panel.report_cycles(station.cycles());
  if (options.exit_when_idle && station.active()) {
    log->error("ended by a signal while a program was still running");
    return exit_failed;
  }
  return options.exit_when_idle && panel.failed() ? exit_failed : exit_done;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"A virtual CNC: serves the ADS objects of a controller and runs NC programs."};
  Options options;
  add_options(app, options);
  return millrace::base::program::run(app, argc, argv, [&] {
    return options.check.empty() ? serve(options) : check_programs(options.check);
  });
}
