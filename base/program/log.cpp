#include "base/program/log.hpp"

#include <CLI/App.hpp>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/null_sink.h>
#include <unistd.h>

#include "base/program/barrier.hpp"
#include "base/program/patient_sink.hpp"

namespace millrace::base::program {

Log make_log(const std::string& name, spdlog::level::level_enum level) {
  // One for all of them: lines wait for their turn in one place.
  static const auto standard_error = std::make_shared<PatientSink>(STDERR_FILENO);
  auto log = std::make_shared<spdlog::logger>(name, standard_error);
  log->set_formatter(std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%eZ %n %-5l %v",
                                                                 spdlog::pattern_time_type::utc));
  log->set_level(level);
  report_contained_to([weak = std::weak_ptr(log)](const std::string& line) {
    const Log still = weak.lock();
    if (still) {
      still->error(line);
    }
    return still != nullptr;
  });
  return log;
}

Log no_log() {
  auto log =
      std::make_shared<spdlog::logger>("none", std::make_shared<spdlog::sinks::null_sink_mt>());
  // Spares the formatting too.
  log->set_level(spdlog::level::off);
  return log;
}

void add_log_level(CLI::App& app, spdlog::level::level_enum& level) {
  app.add_option_function<std::string>(
         "--log-level",
         [&level](const std::string& name) { level = spdlog::level::from_str(name); },
         "What to log on standard error")
      ->check(CLI::IsMember({"error", "warn", "info", "debug", "trace"}))
      ->default_str("info")
      ->type_name("LEVEL");
}

}  // namespace millrace::base::program
