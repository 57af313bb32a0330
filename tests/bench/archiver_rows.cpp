// How many durable rows a second the archive stores, singly and in batches, compared with a bare
// file: 4 KiB written and made durable, again and again.
//
//   archiver_rows [FOLDER [SECONDS]]
//
// FOLDER decides which disk is measured (default: the folder for temporary files). Exit code 1 if
// batches of 256 stay below 5,000 rows/s.
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "services/archiver/archive.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace millrace;
using namespace millrace::services;
using Clock = std::chrono::steady_clock;

constexpr double goal = 5000;
constexpr std::size_t goal_batch = 256;

/// How often `work` runs per second, measured for `length`.
double rate(std::chrono::duration<double> length, const std::function<void()>& work) {
  const auto start = Clock::now();
  std::size_t count = 0;
  while (Clock::now() - start < length) {
    work();
    ++count;
  }
  return static_cast<double>(count) / std::chrono::duration<double>(Clock::now() - start).count();
}

fabric::Time now() {
  return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
}

archiver::Put next_put() {
  static std::uint64_t number = 0;
  return {.call = {.epoch = 1, .number = ++number},
          .key = {.machine = "cnc", .channel = 1},
          .at = now(),
          .state = 1,
          .text = "PUT part=WELLE7 d=\"12.345 mm\" tool=5",
          .fields = {{"part", "WELLE7"}, {"d", "12.345 mm"}, {"tool", "5"}}};
}

double rows_per_second(archiver::Archive& archive, std::size_t batch,
                       std::chrono::duration<double> length) {
  const double batches = rate(length, [&] {
    std::vector<archiver::Row> rows;
    for (std::size_t i = 0; i < batch; ++i) {
      rows.emplace_back(next_put());
    }
    archive.append(std::move(rows), now());
  });
  return batches * static_cast<double>(batch);
}

double bare_writes_per_second(const fs::path& folder, std::chrono::duration<double> length) {
  const base::posix::Fd fd(
      ::open((folder / "bare").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  const std::array<char, 4096> block{};
  return rate(length, [&] {
    if (::write(fd.get(), block.data(), block.size()) < 0 || ::fdatasync(fd.get()) != 0) {
      throw std::runtime_error(base::posix::last_error("bare file"));
    }
  });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) {
    ::setenv("TMPDIR", argv[1], 1);
  }
  const std::chrono::duration<double> length(argc > 2 ? std::atof(argv[2]) : 3.0);
  const tests::TemporaryFolder folder;
  bool reached = true;
  fmt::print("bare file          {:>9.0f} durable writes/s\n",
             bare_writes_per_second(folder.path(), length));
  archiver::Archive archive(folder.path() / "archive", {}, now());
  for (const std::size_t batch : {std::size_t{1}, std::size_t{16}, goal_batch, std::size_t{1024}}) {
    const double rows = rows_per_second(archive, batch, length);
    fmt::print("batches of {:>6}  {:>9.0f} durable rows/s\n", batch, rows);
    reached = reached && (batch != goal_batch || rows >= goal);
  }
  return reached ? 0 : 1;
}
