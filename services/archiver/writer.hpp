// The thread that writes the archive: all rows since the last commit go into the next one, so that
// many callers share one wait for the disk.
//
//   Writer writer(std::move(archive), log);
//   writer.put(std::move(put), [call](const Written& written) { call->answer(…); });
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "base/loop/clock_watch.hpp"
#include "base/program/repeats.hpp"
#include "fabric/alarm.hpp"
#include "services/archiver/archive.hpp"

namespace spdlog {
class logger;
}

namespace millrace::services::archiver {

/// The id of a put that is on the disk, or why it is not.
using Written = tl::expected<std::int64_t, std::string>;

/// Functions may be called from any thread.
class Writer {
 public:
  using Log = std::shared_ptr<spdlog::logger>;

  /// `alarms`, which must outlive it, gets the alarms of the archive: "archive", "lost_rows",
  /// "foreign_files".
  Writer(Archive archive, Log log, fabric::AlarmSink& alarms);
  /// Writes the waiting rows, then ends.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// `done` is called on the writer's thread, once the put is durable or has failed.
  void put(Put put, std::function<void(const Written&)> done);
  /// Adds an observation of the fabric; values of machines may wait for half a second, to be
  /// written together. While the archive cannot be written, rows wait; beyond 100,000 (for samples:
  /// with 8 values each) the oldest are lost and the log reports their number.
  void record(Row row);

 private:
  using Done = std::function<void(const Written&)>;
  /// The contents of one transaction: puts first, with a `done` each, then recorded rows.
  struct Batch {
    std::vector<Row> rows;
    std::vector<Done> done;
  };

  void run();
  /// Waits for rows. Empty after a while, so that the archive can be tidied up. Nullopt at the end,
  /// when no row waits.
  std::optional<Batch> take();
  /// Maintenance between batches.
  void tidy_up();
  [[nodiscard]] bool has_work() const;
  void write(Batch batch);
  /// Returns the recorded rows to the queue for another attempt.
  void keep(std::vector<Row> rows, std::size_t first_recorded);
  /// Logs an error that may repeat with each batch.
  void warn_limited(const std::string& kind, const std::string& text);
  void notice_failure(const std::exception& error);
  void notice_success();
  void notice_foreign_files();

  Log log_;
  fabric::AlarmSink& alarms_;
  Archive archive_;
  base::loop::ClockWatch clock_;
  std::chrono::steady_clock::time_point next_tidying_{};
  std::mutex lock_;
  std::condition_variable changed_;
  std::deque<std::pair<Put, Done>> puts_;
  std::deque<Row> recorded_;
  /// Weight of the waiting recorded rows, limited by max_recorded.
  std::size_t weight_ = 0;
  /// Until when recorded rows may wait for others.
  std::chrono::steady_clock::time_point due_{};
  std::uint64_t lost_ = 0;
  bool failing_ = false;
  base::program::Repeats repeats_;
  std::size_t foreign_files_ = 0;
  /// After a failure: recorded rows wait until then; puts are tried at once.
  std::chrono::steady_clock::time_point retry_{};
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace millrace::services::archiver
