#include "base/program/log.hpp"

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/null_sink.h>
#include <unistd.h>

#include "base/program/barrier.hpp"
#include "base/program/retrying_sink.hpp"
#include "base/program/supervisor.hpp"
#include "base/text/quoted.hpp"

namespace millrace::base::program {

namespace {

/// Formats the line of an event. The text may come from any source: control characters are shown as
/// \xNN, and text after a line end cannot look like a separate event. Under systemd each line
/// begins with its priority, as in sd-daemon(3), so that `journalctl -p warning` finds it.
class LineFormatter final : public spdlog::formatter {
 public:
  explicit LineFormatter(bool with_priority)
      : with_priority_(with_priority),
        pattern_("%Y-%m-%dT%H:%M:%S.%eZ %n %-5l %v", spdlog::pattern_time_type::utc) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const std::string priority =
        with_priority_ ? fmt::format("<{}>", priority_of(message.level)) : "";
    std::string text;
    for (const char c : text::safe({message.payload.data(), message.payload.size()}, "\n")) {
      text += c;
      text += c == '\n' ? priority + "    " : "";
    }
    spdlog::details::log_msg safe = message;
    safe.payload = text;
    line.append(priority);
    pattern_.format(safe, line);
  }

  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<LineFormatter>(with_priority_);
  }

 private:
  /// The numbers of syslog(3).
  static int priority_of(spdlog::level::level_enum level) {
    switch (level) {
      case spdlog::level::critical:
      case spdlog::level::err:
        return 3;
      case spdlog::level::warn:
        return 4;
      case spdlog::level::info:
        return 6;
      default:
        return 7;
    }
  }

  bool with_priority_;
  spdlog::pattern_formatter pattern_;
};

}  // namespace

Log make_log(const std::string& name, spdlog::level::level_enum level) {
  // All logs share one sink, so that their lines are queued in one place.
  static const auto standard_error = std::make_shared<RetryingSink>(STDERR_FILENO);
  auto log = std::make_shared<spdlog::logger>(name, standard_error);
  log->set_formatter(std::make_unique<LineFormatter>(is_journal(STDERR_FILENO)));
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
  // Avoids the formatting too.
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
