#include "tools/commands/replay/report.hpp"

#include <algorithm>
#include <string>

#include <boost/json/object.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::replay {

Progress::Progress(std::size_t total, const char* what)
    : total_(total), what_(what), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::show(std::size_t done) {
  const auto now = Clock::now();
  if (!terminal_ || now < next_) {
    return;
  }
  next_ = now + std::chrono::milliseconds(200);
  drawn_ = true;
  if (total_ == 0) {
    fmt::print(stderr, "\r\033[K{} {}", done, what_);
    return;
  }
  constexpr std::size_t width = 40;
  const std::size_t filled = width * std::min(done, total_) / total_;
  std::string left = "…";
  if (done > 0) {
    const auto per_call = (now - start_) / static_cast<std::int64_t>(done);
    left =
        print::duration_text(per_call * static_cast<std::int64_t>(total_ - std::min(done, total_)));
  }
  fmt::print(stderr, "\r\033[K[{}{}] {} of {} {}, {} left", std::string(filled, '='),
             std::string(width - filled, ' '), done, total_, what_, left);
}

void Progress::clear() {
  if (drawn_) {
    fmt::print(stderr, "\r\033[K");
    drawn_ = false;
  }
}

namespace {

namespace program = base::program;
using namespace tools::replay;

std::string text_of(const Answer& answer) {
  return answer.withheld
             ? fmt::format("({} bytes, not recorded) state {}", *answer.withheld, answer.state)
             : fmt::format("{} state {}", base::text::quoted(answer.text), answer.state);
}

boost::json::object json_of(const Answer& answer) {
  if (answer.withheld) {
    return {{"text_size", *answer.withheld}, {"state", answer.state}};
  }
  return {{"text", print::text_json(answer.text)}, {"state", answer.state}};
}

/// Characters that a terminal shows, of UTF-8.
std::size_t width_of(std::string_view utf8) {
  return static_cast<std::size_t>(std::ranges::count_if(
      utf8, [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) != 0x80U; }));
}

/// Under the byte of the answer that differs.
std::string pointer_to(const Answer& answer, std::size_t at) {
  // The pointer belongs at the closing quote of the part before it.
  return std::string(width_of(base::text::quoted(answer.text.substr(0, at))) - 1, ' ') + '^';
}

double ms_of(nanoseconds duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

void Report::add(const Outcome& outcome) {
  const Judgement judgement =
      judge(plan_.calls[outcome.call], outcome, options_.side, options_.tolerances);
  ++counts_.at(static_cast<std::size_t>(judgement.verdict));
  if (outcome.held_up) {
    ++held_up_;
  } else {
    late_.add(outcome.late);
  }
  if (options_.json) {
    print_line(outcome, judgement);
  } else if (options_.every || is_failure(judgement.verdict)) {
    progress_.clear();
    print_text(outcome, judgement);
  }
}

void Report::print_text(const Outcome& outcome, const Judgement& judgement) const {
  const PlannedCall& call = plan_.calls[outcome.call];
  fmt::print("call {} of {}, {} of {}, service {}: {}\n", outcome.call + 1, plan_.calls.size(),
             call.recorded.to_string(), base::text::safe(call.channel.to_string()),
             base::text::safe(call.uuid),
             judgement.difference ? judgement.difference->what : name_of(judgement.verdict));
  fmt::print("  request   {} state {}\n", base::text::quoted(call.text), call.state);
  if (const TimedAnswer* recorded = expected_of(call, options_.side)) {
    fmt::print("  recorded  {}\n", text_of(recorded->answer));
  }
  if (!outcome.answer) {
    fmt::print("  answered  -  {}\n", base::text::safe(outcome.reason));
    return;
  }
  fmt::print("  answered  {}\n", text_of(*outcome.answer));
  if (judgement.difference && judgement.difference->at) {
    fmt::print("            {}\n", pointer_to(*outcome.answer, *judgement.difference->at));
  }
}

void Report::print_line(const Outcome& outcome, const Judgement& judgement) const {
  const PlannedCall& call = plan_.calls[outcome.call];
  boost::json::object out{
      {"call", call.recorded.to_string()},
      {"number", outcome.call + 1},
      {"round", outcome.round},
      {"machine", print::utf8(call.channel.machine)},
      {"channel", call.channel.channel},
      {"uuid", print::utf8(call.uuid)},
      {"request", {{"text", print::text_json(call.text)}, {"state", call.state}}},
      {"result", name_of(judgement.verdict)},
      {"took_ms", ms_of(outcome.took)}};
  if (const TimedAnswer* recorded = expected_of(call, options_.side)) {
    out["recorded"] = json_of(recorded->answer);
  }
  if (outcome.answer) {
    out["answer"] = json_of(*outcome.answer);
  } else {
    out["reason"] = print::utf8(outcome.reason);
  }
  if (judgement.difference) {
    out["difference"] = print::utf8(judgement.difference->what);
  }
  if (options_.timed) {
    out["late_ms"] = ms_of(outcome.late);
    out["held_up"] = outcome.held_up;
  }
  print::print_json(out);
}

int Report::finish(const std::string& reason) {
  progress_.clear();
  const auto took = std::chrono::steady_clock::now() - start_;
  std::uint64_t calls = 0;
  bool failed = !reason.empty();
  boost::json::object verdicts;
  std::string words;
  for (std::size_t i = 0; i < verdict_count; ++i) {
    const auto verdict = static_cast<Verdict>(i);
    calls += counts_.at(i);
    failed = failed || (is_failure(verdict) && counts_.at(i) > 0);
    verdicts[name_of(verdict)] = counts_.at(i);
    if (counts_.at(i) > 0) {
      words += fmt::format("{}{} {}", words.empty() ? "" : ", ", counts_.at(i), name_of(verdict));
    }
  }
  if (options_.json) {
    boost::json::object summary{{"calls", calls},
                                {"seconds", std::chrono::duration<double>(took).count()},
                                {"results", std::move(verdicts)},
                                {"skipped", plan_.skipped.size()}};
    if (options_.timed) {
      summary["late_ms"] = {{"p50", ms_of(late_.percentile(0.5))},
                            {"p99", ms_of(late_.percentile(0.99))},
                            {"max", ms_of(late_.max())}};
      summary["held_up"] = held_up_;
    }
    if (!reason.empty()) {
      summary["ended"] = print::utf8(reason);
    }
    print::print_json(boost::json::object{{"summary", std::move(summary)}});
  } else {
    fmt::print("{} calls in {}: {}\n", calls, print::duration_text(took),
               words.empty() ? "nothing was replayed" : words);
    if (options_.timed && late_.count() > 0) {
      fmt::print("issued after their time: p50 {}, p99 {}, at most {}{}\n",
                 print::duration_text(late_.percentile(0.5)),
                 print::duration_text(late_.percentile(0.99)), print::duration_text(late_.max()),
                 held_up_ == 0 ? std::string()
                               : fmt::format("; {} waited for the call before them", held_up_));
    }
  }
  std::fflush(stdout);
  if (!reason.empty()) {
    fmt::print(stderr, "millrace: {}\n", base::text::safe(reason));
  }
  return failed ? program::exit_failed : program::exit_done;
}

}  // namespace millrace::tools::commands::replay
