#include "tools/commands/record/record.hpp"

#include <ctime>
#include <map>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/messages/catalogue.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/posix/system.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/profile/command_line.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/print/json.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/print/units.hpp"
#include "tools/recorder/recorder.hpp"
#include "tools/recorder/recording_file.hpp"

namespace millrace::tools::commands::record {

namespace {

namespace program = base::program;

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace record"}) {}

  fabric::profile::FabricFlags fabric;
  recorder::Options recorder;
  std::vector<std::string> without_text;
  std::chrono::nanoseconds window{};
  bool on_error = false;
  bool json = false;
};

/// "millrace-20260301T070000Z.mcap"
std::string default_name() {
  return fmt::format("millrace-{:%Y%m%dT%H%M%SZ}.mcap", fmt::gmtime(std::time(nullptr)));
}

recorder::Options recorder_options(const Options& options,
                                   const fabric::dds::ParticipantOptions& join) {
  recorder::Options result = options.recorder;
  if (result.file.empty()) {
    result.file = default_name();
    result.prefix = "millrace-";
  }
  if (result.keep_size > 0 && result.rotate_size == 0 && result.rotate_time.count() == 0) {
    throw program::UsageError(
        "--keep-size removes whole files; it needs --rotate-size or --rotate-time");
  }
  if (options.on_error != (options.window.count() > 0)) {
    throw program::UsageError("--window needs --on-error, and the other way round");
  }
  if (options.on_error) {
    result.window = recorder::Window{.length = options.window};
  }
  for (const std::string& uuid : options.without_text) {
    result.without_text.insert(fabric::canonical_uuid(uuid));
  }
  result.library = library_name();
  result.labels = {{"host", base::posix::host_name()},
                   {"fabric", join.fabric},
                   {"domain", std::to_string(join.domain)},
                   {"clock", "CLOCK_REALTIME of the recording host"}};
  return result;
}

/// Attaches the configuration of the recorded fabric.
void attach_configuration(const Options& options, recorder::Options& settings) {
  const std::filesystem::path file = options.fabric.file();
  if (file.empty()) {
    return;
  }
  settings.attachments.push_back({.name = file.filename().string(),
                                  .media_type = "text/plain",
                                  .data = base::posix::read_regular(file).value_or(""),
                                  .at = std::chrono::system_clock::now()});
}

/// Repairs earlier recordings of this name that a power failure cut, into files beside them.
void repair_leftovers(const recorder::Options& settings) {
  const bool many = settings.rotate_size > 0 || settings.rotate_time.count() > 0;
  const recorder::Series series(settings.file,
                                many ? recorder::Series::Files::many : recorder::Series::Files::one,
                                settings.prefix);
  for (const std::filesystem::path& part : series.leftovers()) {
    const auto repaired = mcap::free_repaired_name(part);
    const auto report = recorder::repair_recording(part, repaired, library_name());
    if (report) {
      std::filesystem::remove(part);
      fmt::print(stderr, "millrace: {} was not closed; its {} messages are in {} now\n",
                 part.string(), report->saved.messages, repaired.string());
    } else if (std::error_code none;
               std::filesystem::equivalent(part, mcap::part_of(settings.file), none)) {
      throw program::UsageError(
          fmt::format("{} was left by an earlier recording and cannot be repaired: {}",
                      part.string(), report.error()));
    } else {
      fmt::print(
          stderr,
          "millrace: {} was left by an earlier recording, cannot be repaired and is kept: {}\n",
          part.string(), report.error());
    }
  }
}

/// Before the ready line.
void expect_place(const recorder::Options& settings) {
  const auto folder =
      settings.file.has_parent_path() ? settings.file.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder)) {
    throw program::UsageError(
        fmt::format("-o {}: there is no folder {}", settings.file.string(), folder.string()));
  }
  if (std::filesystem::exists(settings.file)) {
    throw program::UsageError(
        fmt::format("-o {}: the file exists; choose another name", settings.file.string()));
  }
}

/// Prints the files, and with JSON also the numbers.
void show(const Options& options, const std::vector<std::filesystem::path>& files,
          const fabric::observer::Counts& counts, const recorder::Recorder& recorder) {
  if (!options.json) {
    for (const std::filesystem::path& file : files) {
      fmt::print("{}\n", file.string());
    }
    return;
  }
  boost::json::array names;
  for (const std::filesystem::path& file : files) {
    names.emplace_back(print::utf8(file.string()));
  }
  const recorder::Tally tally = recorder.tally();
  boost::json::object out{{"files", std::move(names)},  {"delivered", counts.delivered},
                          {"lost", counts.lost},        {"written", tally.written},
                          {"filtered", tally.filtered}, {"let_go", tally.let_go}};
  for (const auto& [name, count] : print::missing_counts(recorder.missing())) {
    out[name] = count;
  }
  print::print_json(out);
}

int record(const Options& options) {
  const fabric::dds::ParticipantOptions join = options.fabric.options();
  recorder::Options settings = recorder_options(options, join);
  attach_configuration(options, settings);
  const std::string file = settings.file.string();
  repair_leftovers(settings);
  expect_place(settings);
  fabric::dds::Participant participant(join);
  RecordRun run(participant, std::move(settings), fabric::profile::given_flags(options.fabric));
  if (const auto begun = run.start(); !begun) {
    throw std::runtime_error(begun.error());
  }
  program::ready(
      fmt::format("recording fabric {} on domain {} to {}", join.fabric, join.domain, file));
  const auto result = run.run();
  const recorder::Tally tally = run.recorder().tally();
  const fabric::observer::Counts counts = run.counts();
  fmt::print(stderr,
             "millrace: {} samples were received and {} lost; {} written, {} filtered out, {} "
             "dropped by the window\nmillrace: {}\n",
             counts.delivered, counts.lost, tally.written, tally.filtered, tally.let_go,
             print::missing_text(run.recorder().missing()));
  if (!result) {
    throw std::runtime_error(result.error());
  }
  if (counts.delivered == 0) {
    fmt::print(stderr, "millrace: nothing was received on fabric {}, domain {}\n", join.fabric,
               join.domain);
  }
  show(options, run.recorder().files(), counts, run.recorder());
  return run.recorder().disk_is_full() ? program::exit_failed : program::exit_done;
}

void add_options(CLI::App& command, Options& options) {
  command
      .add_option("-o,--output", options.recorder.file,
                  "The file; default millrace-TIME.mcap. It grows as FILE.part")
      ->type_name("FILE");
  add_json(command, options.json);
  add_filter(command, options.recorder.filter);
  command.add_option("--without-text", options.without_text,
                     "Record sizes and states of this service, not texts; may be repeated");
  add_size(command, "--rotate-size", options.recorder.rotate_size, "Begin a new file at this size");
  add_duration(command, "--rotate-time", options.recorder.rotate_time,
               "Begin a new file after this time");
  add_size(command, "--keep-size", options.recorder.keep_size,
           "Remove the oldest files of this name when they are larger than this, or the disk has "
           "less than --min-free left");
  add_size(command, "--min-free", options.recorder.minimum_free,
           "End when the disk has less than this left; default 100MiB");
  add_duration(command, "--window", options.window,
               "Keep only the last DURATION, in memory; needs --on-error");
  command.add_flag("--on-error", options.on_error,
                   "Write the window, and one more second, when a call fails");
  static const std::map<std::string, recorder::Sync> policies{
      {"none", recorder::Sync::none},
      {"interval", recorder::Sync::interval},
      {"call", recorder::Sync::call}};
  program::add_choice(command, "--sync", options.recorder.sync, policies,
                      "When data is forced to the disk; interval is 4 times a second")
      ->default_str("interval");
  static const std::map<std::string, mcap::Compression> compressions{
      {"none", mcap::Compression::none}, {"zstd", mcap::Compression::zstd}};
  program::add_choice(command, "--compression", options.recorder.compression, compressions,
                      "Compression of chunks")
      ->default_str("none");
}

}  // namespace

void add_record(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "record", "Record everything on the fabric into an MCAP file, until interrupted",
      "millrace record -o run.mcap --machine cnc\n"
      "  millrace record --window 30s --on-error -o incident.mcap");
  auto options = std::make_shared<Options>(command);
  add_options(command, *options);
  run_if_chosen(command, chosen, options, record);
}

namespace {

fabric::Alarm this_recorder(const fabric::InstanceId& responder) {
  return {.key = {.responder = responder},
          .program = "millrace record",
          .host = base::posix::host_name(),
          .pid = static_cast<std::uint32_t>(::getpid())};
}

}  // namespace

RecordRun::RecordRun(fabric::dds::Participant& participant, recorder::Options options,
                     std::string flags)
    : flags_(std::move(flags)),
      condition_{.file = options.file,
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
  take_rest();
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

void RecordRun::take_rest() {
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
      report_waiting();
      report_condition();
      if (recorder_.disk_is_full() && !recorder_.waits_for_room()) {
        fmt::print(stderr, "millrace: the disk is nearly full; recording ends\n");
        end_with(base::messages::recorder_ended_without_room(
            condition_.file.string(), print::size_text(condition_.minimum_free)));
        io_.stop();
      }
      schedule_tick();
    }
  });
}

/// Views show that the recorder is gone, and this reason.
void RecordRun::end_with(const fabric::Message& reason) {
  note(alarms_.raise({.key = {.kind = "recording"},
                      .level = fabric::AlarmLevel::problem,
                      .text = reason,
                      .advice = base::messages::see_its_log(base::posix::host_name())}));
  alarms_.leave_alarms();
}

void RecordRun::warn_if_silent() {
  if (!warned_of_silence_ && Clock::now() - begun_ > discovery_time) {
    warned_of_silence_ = true;
    if (counts().delivered == 0) {
      fmt::print(
          stderr,
          "millrace: nothing was received for {} s; 'millrace doctor{}' checks this fabric\n",
          discovery_time.count(), flags_);
    }
  }
}

void RecordRun::report_waiting() {
  if (std::exchange(waited_, recorder_.waits_for_room()) != recorder_.waits_for_room()) {
    fmt::print(stderr, "millrace: {}\n",
               recorder_.waits_for_room()
                   ? "the disk is nearly full; nothing is recorded until there is room"
                   : "there is room on the disk again; recording goes on");
  }
}

void RecordRun::report_condition() {
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
  for (const std::string& kind : raised_) {
    if (!kinds.contains(kind)) {
      note(alarms_.clear(kind));
    }
  }
  raised_ = std::move(kinds);
}

void RecordRun::note(const tl::expected<void, std::string>& published) {
  if (!published && !std::exchange(reported_unpublished_, true)) {
    fmt::print(stderr, "millrace: the recorder cannot publish its alarms: {}\n", published.error());
  }
}

void RecordRun::keep(const recorder::Recorder::Result& result) {
  if (!result && result_) {
    result_ = result;
    end_with(result.error());
    io_.stop();
  }
}

}  // namespace millrace::tools::commands::record
