// How exactly `millrace replay` keeps the recorded times at rate 1, with a live service, compared
// with a bare timer for the same times.
//
//   replay_timing [CALLS]
//
// Exit code 1 if the 99th percentile of the error is above 1 ms.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <fmt/format.h>

#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/recorder/recording_file.hpp"
#include "tools/recording/statistics.hpp"

namespace {

namespace fs = std::filesystem;
using namespace millrace;
using namespace millrace::tools;
using Clock = std::chrono::steady_clock;

constexpr double goal_ms = 1;

/// Calls of eight channels, 0.5 to 9.5 ms apart.
std::vector<std::chrono::microseconds> times_of(std::size_t calls) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> gap(500, 9500);
  std::vector<std::chrono::microseconds> times;
  std::chrono::microseconds at{};
  for (std::size_t i = 0; i < calls; ++i) {
    times.push_back(at);
    at += std::chrono::microseconds(gap(random));
  }
  return times;
}

template <typename Result>
void check(const Result& result) {
  if (!result) {
    throw std::runtime_error(result.error());
  }
}

void write_recording(const fs::path& file, const std::vector<std::chrono::microseconds>& times) {
  auto recording = recorder::RecordingFile::create(file, {.library = "millrace bench"});
  check(recording);
  const fabric::Time start(std::chrono::seconds(1772352000));
  const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  for (std::size_t i = 0; i < times.size(); ++i) {
    const fabric::ChannelKey key{"cnc", static_cast<std::uint16_t>(1 + i % 8)};
    const fabric::CallId call{7, i + 1};
    check((*recording)
              ->write({.at = start + times[i],
                       .uuid = uuid,
                       .sample = fabric::Request{
                           .key = key, .call = call, .uuid = uuid, .text = "2", .state = 1}}));
    check((*recording)
              ->write({.at = start + times[i] + std::chrono::microseconds(300),
                       .uuid = uuid,
                       .sample = fabric::Reply{
                           .key = key, .call = call, .text = "1.414214", .state = 1}}));
  }
  check((*recording)->finish({}));
}

void print(const char* what, double p50, double p99, double max) {
  fmt::print("{:<12} p50 {:.3f} ms  p99 {:.3f} ms  max {:.3f} ms\n", what, p50, p99, max);
}

void time_bare(const std::vector<std::chrono::microseconds>& times) {
  boost::asio::io_context io;
  boost::asio::steady_timer timer(io);
  recording::Histogram late;
  const auto start = Clock::now();
  for (const auto at : times) {
    timer.expires_at(start + at);
    timer.wait();
    late.add(Clock::now() - (start + at));
  }
  const auto ms = [](std::chrono::nanoseconds time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  print("bare timer", ms(late.percentile(0.5)), ms(late.percentile(0.99)), ms(late.max()));
}

int measure(const fs::path& folder, std::size_t calls) {
  const auto times = times_of(calls);
  const fs::path file = folder / "timing.mcap";
  write_recording(file, times);
  time_bare(times);
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  tests::Process service({tests::binary("millrace-square-root"), "--domain", number,
                          "--concurrency", "8", "--log-level", "error"});
  service.await("^ready: ");
  tests::Process replay({tests::binary("millrace"), "replay", "--to-services", "--verify", "--json",
                         "--domain", number, file.string()});
  if (replay.wait(std::chrono::minutes(4)) != 0) {
    throw std::runtime_error(replay.error_output());
  }
  const std::string output = replay.output();
  const std::size_t last = output.rfind('\n', output.size() - 2) + 1;
  const auto summary = boost::json::parse(output.substr(last)).at("summary").as_object();
  const auto& late = summary.at("late_ms").as_object();
  const double p99 = late.at("p99").to_number<double>();
  print("replay", late.at("p50").to_number<double>(), p99, late.at("max").to_number<double>());
  fmt::print("{} calls, {} of them held up by the one before\n",
             summary.at("calls").to_number<int>(), summary.at("held_up").to_number<int>());
  return p99 <= goal_ms ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const tests::TemporaryFolder folder;
    return measure(folder.path(), static_cast<std::size_t>(argc > 1 ? std::atoi(argv[1]) : 4000));
  } catch (const std::exception& error) {
    fmt::print(stderr, "replay_timing: {}\n", error.what());
    return 2;
  }
}
