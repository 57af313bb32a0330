#include "tools/commands/record/record_run.hpp"

#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "base/posix/host.hpp"

namespace millrace::tools::commands::record {

namespace {

fabric::Alarm this_recorder(const fabric::InstanceId& responder) {
  return {.key = {.responder = responder},
          .program = "millrace record",
          .host = base::posix::host_name(),
          .pid = static_cast<std::uint32_t>(::getpid())};
}

}  // namespace

RecordRun::RecordRun(fabric::dds::Participant& participant, recorder::Options options)
    : condition_{.file = options.file,
                 .minimum_free = options.minimum_free,
                 .makes_room = options.keep_size > 0},
      recorder_(std::move(options)),
      timer_(io_),
      signals_(io_, SIGINT, SIGTERM),
      observer_(participant, io_.get_executor(), *this, fabric::observer::Interest::everything),
      alarms_(participant, io_.get_executor(), this_recorder(responder_)) {}

recorder::Recorder::Result RecordRun::run() {
  signals_.async_wait([this](const boost::system::error_code&, int) { io_.stop(); });
  schedule_tick();
  if (result_) {
    io_.run();
  }
  take_the_rest();
  const fabric::observer::Counts counts = this->counts();
  if (result_) {
    keep(recorder_.finish(counts.delivered, counts.lost, std::chrono::system_clock::now()));
  }
  return result_;
}

void RecordRun::on_entry(recording::Entry entry) {
  // Its own alarms are in the metadata of its file, and do not count as a heard process.
  const auto* news = std::get_if<recording::AlarmNews>(&entry.sample);
  if (news != nullptr && news->alarm.key.responder == responder_) {
    ++own_;
    return;
  }
  if (result_) {
    keep(recorder_.on_entry(std::move(entry), Clock::now()));
  }
}

void RecordRun::on_ignored(const std::string& reason) {
  fmt::print(stderr, "millrace: {}\n", reason);
}

fabric::observer::Counts RecordRun::counts() const {
  fabric::observer::Counts counts = observer_.counts();
  counts.delivered -= own_;
  return counts;
}

void RecordRun::take_the_rest() {
  constexpr auto patience = std::chrono::seconds(5);
  const auto until = Clock::now() + patience;
  while (observer_.drain() && Clock::now() < until) {
  }
}

void RecordRun::schedule_tick() {
  timer_.expires_after(std::chrono::milliseconds(50));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      keep(recorder_.tick(Clock::now()));
      for (const std::filesystem::path& file : recorder_.take_removed()) {
        fmt::print(stderr, "millrace: {} was removed to make room for newer files\n",
                   file.string());
      }
      warn_if_silent();
      say_if_it_waits();
      tell_condition();
      if (recorder_.disk_is_full() && !recorder_.waits_for_room()) {
        fmt::print(stderr, "millrace: the disk is nearly full; recording ends\n");
        io_.stop();
      }
      schedule_tick();
    }
  });
}

void RecordRun::warn_if_silent() {
  if (!warned_of_silence_ && Clock::now() - begun_ > time_to_be_heard) {
    warned_of_silence_ = true;
    if (counts().delivered == 0) {
      fmt::print(stderr,
                 "millrace: nothing was received for {} s; 'millrace doctor' checks this fabric\n",
                 time_to_be_heard.count());
    }
  }
}

void RecordRun::say_if_it_waits() {
  if (std::exchange(waited_, recorder_.waits_for_room()) != recorder_.waits_for_room()) {
    fmt::print(stderr, "millrace: {}\n",
               recorder_.waits_for_room()
                   ? "the disk is nearly full; nothing is recorded until there is room"
                   : "there is room on the disk again; recording goes on");
  }
}

void RecordRun::tell_condition() {
  if (Clock::now() < next_word_) {
    return;
  }
  next_word_ = Clock::now() + std::chrono::seconds(1);
  condition_.writes = recorder_.writes();
  condition_.waits_for_room = recorder_.waits_for_room();
  condition_.free = recorder_.free_space();
  condition_.lost = counts().lost;
  condition_.missing = recorder_.missing();
  std::set<std::string> kinds;
  for (const fabric::Alarm& alarm : recorder::alarms_of(condition_)) {
    kinds.insert(alarm.key.kind);
    note(alarms_.raise(alarm));
  }
  for (const std::string& kind : told_) {
    if (!kinds.contains(kind)) {
      note(alarms_.clear(kind));
    }
  }
  told_ = std::move(kinds);
}

void RecordRun::note(const tl::expected<void, std::string>& told) {
  if (!told && !std::exchange(said_untold_, true)) {
    fmt::print(stderr, "millrace: the recorder cannot publish its alarms: {}\n", told.error());
  }
}

void RecordRun::keep(const recorder::Recorder::Result& result) {
  if (!result && result_) {
    result_ = result;
    io_.stop();
  }
}

}  // namespace millrace::tools::commands::record
