#include "services/archiver/writer.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include "base/messages/catalogue.hpp"

namespace millrace::services::archiver {

namespace {

using Clock = std::chrono::steady_clock;

/// The kind of an error that ends with the first successful batch.
constexpr const char* unwritable = "write";
constexpr std::size_t max_batch = 4096;
constexpr std::size_t max_recorded = 100'000;
constexpr std::chrono::seconds retry_after{1};
/// How long values of machines wait for further rows: a commit costs more than the values of one
/// sample period.
constexpr std::chrono::milliseconds together{500};
/// How often the closing of files that are being read is retried, and the longest time between two
/// checks of the clock.
constexpr std::chrono::seconds untidy_pause{1};
constexpr std::chrono::minutes pause{10};

std::size_t weight_of(const Row& row) {
  constexpr std::size_t values_in_one = 8;
  const auto* const sample = std::get_if<fabric::DataSample>(&row);
  return sample == nullptr ? 1 : 1 + sample->values.size() / values_in_one;
}

/// Another process keeps the file locked: space on the disk is no remedy.
bool is_locked(const std::exception& error) {
  const auto* const sqlite = dynamic_cast<const SQLite::Exception*>(&error);
  return sqlite != nullptr &&
         (sqlite->getErrorCode() == SQLITE_BUSY || sqlite->getErrorCode() == SQLITE_LOCKED);
}

}  // namespace

Writer::Writer(Archive archive, Log log, fabric::AlarmSink& alarms)
    : log_(std::move(log)),
      alarms_(alarms),
      archive_(std::move(archive)),
      clock_("rows of the archive", archive_.last_written(), base::loop::clocks_now()),
      thread_([this] { run(); }) {}

Writer::~Writer() {
  {
    const std::lock_guard guard(lock_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Writer::put(Put put, Done done) {
  {
    const std::lock_guard guard(lock_);
    puts_.emplace_back(std::move(put), std::move(done));
  }
  changed_.notify_one();
}

void Writer::record(Row row) {
  {
    const std::lock_guard guard(lock_);
    const auto now = Clock::now();
    const bool may_wait = std::holds_alternative<fabric::DataSample>(row);
    due_ = may_wait ? (recorded_.empty() ? now + together : due_) : now;
    weight_ += weight_of(row);
    recorded_.push_back(std::move(row));
    while (weight_ > max_recorded) {
      weight_ -= weight_of(recorded_.front());
      recorded_.pop_front();
      ++lost_;
    }
  }
  changed_.notify_one();
}

void Writer::run() {
  tidy_up();
  while (auto batch = take()) {
    if (!batch->rows.empty()) {
      write(*std::move(batch));
    }
    tidy_up();
  }
}

void Writer::tidy_up() {
  const base::loop::Clocks now = base::loop::clocks_now();
  if (now.steady < next_tidying_) {
    return;
  }
  next_tidying_ = now.steady + untidy_pause;
  const Ages ages = clock_.believes(now) ? Ages::believed : Ages::doubted;
  if (const auto news = clock_.news()) {
    log_->warn("{}", *news);
  }
  try {
    archive_.tidy_up(now.wall, ages);
  } catch (const std::exception& error) {
    warn_limited("tidy", fmt::format("old files of the archive {} cannot be removed: {}",
                                     archive_.file().string(), error.what()));
  }
  notice_foreign_files();
}

bool Writer::has_work() const {
  return !puts_.empty() ||
         (!recorded_.empty() && (ending_ || Clock::now() >= std::max(retry_, due_)));
}

std::optional<Writer::Batch> Writer::take() {
  std::unique_lock guard(lock_);
  const auto look_around = Clock::now() + (archive_.untidy() ? untidy_pause : pause);
  while (!has_work() && !ending_ && Clock::now() < look_around) {
    changed_.wait_until(
        guard, recorded_.empty() ? look_around : std::min(look_around, std::max(retry_, due_)));
  }
  if (ending_ && !has_work()) {
    return std::nullopt;
  }
  Batch batch;
  while (!puts_.empty() && batch.rows.size() < max_batch) {
    batch.rows.emplace_back(std::move(puts_.front().first));
    batch.done.push_back(std::move(puts_.front().second));
    puts_.pop_front();
  }
  std::size_t weight = batch.rows.size();
  while (!recorded_.empty() && (ending_ || Clock::now() >= retry_) && weight < max_batch) {
    const std::size_t of_this = weight_of(recorded_.front());
    weight += of_this;
    weight_ -= of_this;
    batch.rows.push_back(std::move(recorded_.front()));
    recorded_.pop_front();
  }
  return batch;
}

void Writer::write(Batch batch) {
  std::vector<std::int64_t> ids;
  try {
    ids = archive_.append(batch.rows, std::chrono::system_clock::now());
  } catch (const std::exception& error) {
    warn_limited(unwritable, fmt::format("the archive {} cannot be written: {}",
                                         archive_.file().string(), error.what()));
    notice_failure(error);
    for (const Done& done : batch.done) {
      done(tl::unexpected(std::string(error.what())));
    }
    keep(std::move(batch.rows), batch.done.size());
    return;
  }
  notice_success();
  for (std::size_t i = 0; i < batch.done.size(); ++i) {
    batch.done[i](ids[i]);
  }
}

void Writer::keep(std::vector<Row> rows, std::size_t first_recorded) {
  std::unique_lock guard(lock_);
  const auto recorded = rows.begin() + static_cast<std::ptrdiff_t>(first_recorded);
  if (ending_) {
    lost_ += static_cast<std::uint64_t>(rows.end() - recorded) + recorded_.size();
    recorded_.clear();
    weight_ = 0;
  } else if (recorded != rows.end()) {
    for (auto row = recorded; row != rows.end(); ++row) {
      weight_ += weight_of(*row);
    }
    recorded_.insert(recorded_.begin(), std::make_move_iterator(recorded),
                     std::make_move_iterator(rows.end()));
    retry_ = Clock::now() + retry_after;
  }
  const std::uint64_t lost = lost_;
  guard.unlock();
  if (lost != 0) {
    warn_limited("lost", fmt::format("{} recorded rows are lost so far", lost));
    alarms_.raise({.key = {.kind = "lost_rows"},
                   .level = fabric::AlarmLevel::warning,
                   .text = base::messages::archive_rows_lost(lost),
                   .advice = base::messages::archive_rows_elsewhere()});
  }
}

void Writer::warn_limited(const std::string& kind, const std::string& text) {
  if (const auto line = repeats_.note(kind, text, Clock::now())) {
    log_->error("{}", *line);
  }
}

void Writer::notice_failure(const std::exception& error) {
  failing_ = true;
  alarms_.raise(
      {.key = {.kind = "archive"},
       .level = fabric::AlarmLevel::problem,
       .text = base::messages::archive_not_written(archive_.file().string(), error.what()),
       .advice = is_locked(error) ? base::messages::archive_unlock()
                                  : base::messages::archive_free_space()});
}

void Writer::notice_success() {
  if (std::exchange(failing_, false)) {
    alarms_.clear("archive", "");
    log_->info("the archive {} is writable again; {} attempts failed", archive_.file().string(),
               repeats_.over(unwritable));
  }
}

void Writer::notice_foreign_files() {
  const std::set<std::filesystem::path>& files = archive_.foreign();
  if (std::exchange(foreign_files_, files.size()) != files.size()) {
    alarms_.raise(
        {.key = {.kind = "foreign_files"},
         .level = fabric::AlarmLevel::warning,
         .text = base::messages::archive_foreign_file(
             files.size() > 1 ? base::messages::and_more(files.begin()->string(), files.size() - 1)
                              : fabric::Message(files.begin()->string())),
         .advice = base::messages::archive_move_files()});
  }
}

}  // namespace millrace::services::archiver
