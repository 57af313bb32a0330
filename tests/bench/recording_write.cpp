// How fast entries are recorded, compared with bare writes of as many bytes; then how long
// `millrace recording info` takes on a file of that size, which it reads from its summary.
//
//   recording_write [FOLDER [GIBIBYTES]]
//
// FOLDER decides which disk is measured (default: the folder for temporary files); the file, 1 GiB
// unless given, is removed. Exit code 1 below 100,000 messages/s or above 100 ms.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "tests/bench/series.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/recorder/recording_file.hpp"

namespace {

namespace fs = std::filesystem;
using namespace millrace;
using namespace millrace::tools;
using bench::Clock;

constexpr double goal_rate = 100'000;
constexpr double goal_ms = 100;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A recorder's samples of one call: request, reply, withdrawal, and the gateway's five events.
std::vector<recording::Entry> entries_of(std::uint64_t number) {
  const fabric::Time at(std::chrono::seconds(1772352000) + std::chrono::milliseconds(number));
  const fabric::ChannelKey key{"cnc", static_cast<std::uint16_t>(1 + number % 8)};
  const fabric::CallId call{0x5f3a9c0112d4, number};
  const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const auto entry = [&](recording::Sample sample) {
    return recording::Entry{.at = at, .uuid = uuid, .sample = std::move(sample)};
  };
  std::vector<recording::Entry> entries;
  entries.push_back(entry(fabric::Request{.key = key,
                                          .call = call,
                                          .uuid = uuid,
                                          .text = "PUT part=WELLE7 d=\"12.345 mm\" tool=5",
                                          .state = 1,
                                          .seen = at,
                                          .dispatched = at}));
  entries.push_back(entry(fabric::Reply{.key = key,
                                        .call = call,
                                        .text = "OK 4711",
                                        .state = 1,
                                        .received = at,
                                        .started = at,
                                        .answered = at}));
  entries.push_back(entry(recording::Withdrawal{.key = key, .call = call}));
  for (const auto kind : {fabric::EventKind::seen, fabric::EventKind::dispatched,
                          fabric::EventKind::replied, fabric::EventKind::written}) {
    entries.push_back(entry(fabric::Event{.key = key,
                                          .call = call,
                                          .attempt = 1,
                                          .kind = kind,
                                          .at = at,
                                          .uuid = uuid,
                                          .text = "OK 4711",
                                          .state = 1}));
  }
  return entries;
}

template <typename Result>
void check(const Result& result) {
  if (!result) {
    throw std::runtime_error(result.error());
  }
}

struct Written {
  std::uint64_t messages = 0;
  double seconds = 0;
};

Written write_recording(const fs::path& file, std::uint64_t bytes) {
  std::vector<recording::Entry> entries;
  for (std::uint64_t number = 1; number <= 4096; ++number) {
    std::ranges::move(entries_of(number), std::back_inserter(entries));
  }
  auto recording = recorder::RecordingFile::create(file, {.library = "millrace bench"});
  check(recording);
  Written written;
  const auto start = Clock::now();
  while ((*recording)->size() < bytes) {
    for (const recording::Entry& entry : entries) {
      check((*recording)->write(entry));
    }
    written.messages += entries.size();
  }
  check((*recording)->finish({}));
  written.seconds = seconds_since(start);
  return written;
}

/// Seconds for bare writes of 256 KiB, the size of a chunk.
double write_bare(const fs::path& file, std::uint64_t bytes) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const std::vector<char> block(std::size_t{256} * 1024, 'x');
  const auto start = Clock::now();
  for (std::uint64_t done = 0; fd >= 0 && done < bytes; done += block.size()) {
    if (::write(fd, block.data(), block.size()) < 0) {
      break;
    }
  }
  ::close(fd);
  return seconds_since(start);
}

/// Milliseconds of the whole process; the median of seven.
double log_info(const fs::path& file) {
  bench::Series times;
  for (int i = 0; i < 7; ++i) {
    const auto start = Clock::now();
    tests::Process process({tests::binary("millrace"), "recording", "info", file.string()});
    if (process.wait() != 0) {
      throw std::runtime_error(process.error_output());
    }
    times.add(Clock::now() - start);
  }
  return times.median() / 1000;
}

int measure(const fs::path& folder, double gibibytes) {
  const auto bytes = static_cast<std::uint64_t>(gibibytes * 1024 * 1024 * 1024);
  const double bare = write_bare(folder / "bare", bytes);
  fs::remove(folder / "bare");
  const fs::path file = folder / "bench.mcap";
  const Written written = write_recording(file, bytes);
  const double rate = static_cast<double>(written.messages) / written.seconds;
  const auto size = static_cast<double>(fs::file_size(file));
  fmt::print("bare writes   {:>9.0f} MB/s\n", static_cast<double>(bytes) / bare / 1e6);
  fmt::print("recording     {:>9.0f} MB/s  {:>9.0f} messages/s of {:.0f} bytes\n",
             size / written.seconds / 1e6, rate, size / static_cast<double>(written.messages));
  const double info = log_info(file);
  fmt::print("recording info {:>9.1f} ms on {:.2f} GiB, {} messages\n", info,
             size / 1024 / 1024 / 1024, written.messages);
  return rate >= goal_rate && info <= goal_ms ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) {
    ::setenv("TMPDIR", argv[1], 1);
  }
  try {
    const tests::TemporaryFolder folder;
    return measure(folder.path(), argc > 2 ? std::atof(argv[2]) : 1.0);
  } catch (const std::exception& error) {
    fmt::print(stderr, "recording_write: {}\n", error.what());
    return 2;
  }
}
