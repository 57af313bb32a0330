// The thread that writes the archive: whatever has come since the last commit goes into the next,
// so that many callers share one wait for the disk.
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
#include "fabric/notice_sink.hpp"
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

  /// `notices`, which outlives it, gets to know what troubles the archive: "archive", "lost_rows",
  /// "foreign_files".
  Writer(Archive archive, Log log, fabric::NoticeSink& notices);
  /// Writes what is waiting, then ends.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// `done` is called on the writer's thread, once the put is durable or has failed.
  void put(Put put, std::function<void(const Written&)> done);
  /// What is seen on the fabric; values of machines may wait for half a second, to be written
  /// together. While the archive cannot be written they wait, and the oldest of more than 100,000
  /// (of samples: with 8 values each) are lost, which the log tells.
  void record(Row row);

 private:
  using Done = std::function<void(const Written&)>;
  /// What goes into one transaction: puts first, with a `done` each, then recorded rows.
  struct Batch {
    std::vector<Row> rows;
    std::vector<Done> done;
  };

  void run();
  /// Waits for rows; empty after a while if the archive has something to do besides. Nothing once
  /// the end has come and nothing waits.
  std::optional<Batch> take();
  /// What nobody waits for: between batches.
  void tidy_up();
  [[nodiscard]] bool has_work() const;
  void write(Batch batch);
  /// Puts the recorded rows back, to be tried again.
  void keep(std::vector<Row> rows, std::size_t first_recorded);
  /// An error that may come with each batch.
  void complain(const std::string& kind, const std::string& text);
  void notice_failure(const std::string& reason);
  void notice_success();
  void notice_foreign_files();

  Log log_;
  fabric::NoticeSink& notices_;
  Archive archive_;
  base::loop::ClockWatch clock_;
  std::chrono::steady_clock::time_point next_tidying_{};
  std::mutex lock_;
  std::condition_variable changed_;
  std::deque<std::pair<Put, Done>> puts_;
  std::deque<Row> recorded_;
  /// How much of the room for recorded rows they take.
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
