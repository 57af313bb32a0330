#include "cnc/simulator/panel.hpp"

#include <chrono>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"

namespace millrace::cnc::simulator {

namespace {

using base::text::to_utf8;

/// Prints a line of a channel on standard output and flushes, so that a reader sees it at once.
void print_line(std::uint32_t channel, std::string_view text) {
  fmt::print("[ch{}] {}\n", channel, text);
  std::fflush(stdout);
}

/// One overload per event. Events without interest for the operator go to the log for the
/// integrator.
struct Show {
  std::uint32_t channel;
  spdlog::logger& log;
  ReportFiles& files;
  bool& failed;
  tl::expected<void, std::string>& shown;

  void operator()(const nc::MessageEvent& message) const {
    print_line(channel, to_utf8(message.text));
  }
  void operator()(const nc::SaveEvent& saved) const {
    shown = files.append(saved, std::chrono::system_clock::now());
    if (!shown) {
      failed = true;
      log.error("channel {}: {}", channel, shown.error());
    }
  }
  void operator()(const nc::MachineFunctionEvent& function) const {
    log.debug("channel {}: M{:02}{}", channel, function.number,
              function.argument ? fmt::format("={}", *function.argument) : "");
  }
  void operator()(const nc::HeldEvent& held) const {
    log.warn("channel {}: on hold after {} at {}:{}", channel,
             held.single_step ? "single step" : "M00 or M01", held.place.file, held.place.line);
  }
  void operator()(const nc::WarningEvent& warning) const {
    log.warn("channel {}: {}", channel, to_utf8(warning.what.to_string("warning")));
  }
  void operator()(const nc::FinishedEvent& /*finished*/) const {
    log.info("channel {}: the NC program is done", channel);
  }
  void operator()(const nc::AbortedEvent& aborted) const {
    failed = true;
    log.error("channel {}: the program was aborted: {}", channel, to_utf8(aborted.why.to_string()));
  }
};

}  // namespace

Panel::Panel(base::program::Log log, ReportFiles files, bool keep_timings)
    : log_(std::move(log)), files_(std::move(files)), keep_timings_(keep_timings) {}

tl::expected<void, std::string> Panel::show(const NcEvent& happening) {
  tl::expected<void, std::string> shown;
  std::visit(Show{happening.channel, *log_, files_, failed_, shown}, happening.event);
  return shown;
}

void Panel::show_mistakes(std::uint32_t channel, const std::vector<nc::Diagnostic>& mistakes) {
  failed_ = true;
  for (const nc::Diagnostic& mistake : mistakes) {
    log_->error("channel {}: not started: {}", channel, to_utf8(mistake.to_string()));
  }
}

void Panel::remember(std::uint32_t channel, const AnsweredCall& call) {
  if (keep_timings_) {
    calls_.emplace_back(channel, call);
  }
}

void Panel::report_cycles(const CycleCounts& cycles) const {
  log_->info("{} of {} interpolator cycles were late, the worst by {:.2f} ms", cycles.late,
             cycles.done, std::chrono::duration<double, std::milli>(cycles.worst).count());
}

void Panel::print_timings() const {
  for (const auto& [channel, call] : calls_) {
    const std::chrono::duration<double, std::milli> duration = call.duration;
    print_line(channel, fmt::format("call {}: {}: {:.2f} ms", call.number, to_utf8(call.uuid),
                                    duration.count()));
  }
}

}  // namespace millrace::cnc::simulator
