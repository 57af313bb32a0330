// The cost of `millrace web` with browsers at a plant with continuous calls.
//
//   web_load [SECONDS [BROWSERS [CALLS_PER_SECOND [WITH_DATA]]]]
//
// A gateway's side of the fabric with 20 machines of 10 channels, 100 values of each of 4 of them
// ten times a second, one service as a process, `millrace web` as another, and BROWSERS browsers,
// each of which reads all events. WITH_DATA of them (default 10) have the view of machine data
// open: six lines twice a second, all values and the programs of a machine every two seconds.
// Prints the duration of a call without and with them, the delay from its end to the browser's
// event, the duration of requests for lines, and the resources of the web server.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/json/parse.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/text/times.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/bench/web/busy_plant.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/http_client.hpp"
#include "tests/support/process.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::bench {

// Browsers of `millrace web`, each of which reads all events.
//
//   BrowserProcess browsers(50, 10);
//   browsers.start(port);
//   browsers.finish();
/// Prints `what`, the number of measured `things`, and their times.
void print_times(const char* what, const char* things, const tools::recording::Histogram& times);

/// In reality browsers are on other hosts: here they are a separate process with low priority.
class BrowserProcess {
 public:
  /// `with_data` of `count` have the view of machine data open. Construct it before there are
  /// threads.
  BrowserProcess(int count, int with_data);
  ~BrowserProcess();
  BrowserProcess(const BrowserProcess&) = delete;
  BrowserProcess& operator=(const BrowserProcess&) = delete;

  /// They read from the server on this port of the loopback.
  void start(std::uint16_t port) const;
  /// The bytes that all of them have read.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Prints their measurements. The server has ended.
  void finish();

 private:
  void serve(int count, int with_data);

  std::array<int, 2> to_{};
  std::array<int, 2> from_{};
  pid_t pid_ = -1;
};

}  // namespace millrace::bench

namespace millrace::bench {

namespace {

constexpr int lines_of_a_browser = 6;
constexpr auto between_lines = std::chrono::milliseconds(500);
/// The tables come with each fourth response for the lines.
constexpr int lines_a_table = 4;

/// One thread for each browser. The first one parses the events, the others only read them. Those
/// that show machine data request it in a second thread.
class Browsers {
 public:
  Browsers(std::uint16_t port, int count, int with_data) {
    for (int i = 0; i < with_data; ++i) {
      threads_.emplace_back([this, port, i] {
        try {
          show_data(port, i);
        } catch (const std::exception&) {
          // The server ends when the measurement does.
        }
      });
    }
    for (int i = 0; i < count; ++i) {
      threads_.emplace_back([this, port, is_first = i == 0] {
        try {
          tests::HttpEvents events(port, "/api/live");
          while (!over_) {
            const tests::HttpEvent event = events.next();
            bytes_ += event.data.size();
            if (is_first && event.name == "changes") {
              measure(event.data);
            }
          }
        } catch (const std::exception&) {
          // The server ends when the measurement does.
        }
      });
    }
  }
  ~Browsers() { finish(); }

  /// Waits until each has received something more, or the end.
  void finish() {
    over_ = true;
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

  /// From the end of a call to its event; to be read when they have finished.
  Histogram delays;
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// From the request to the response for the lines of a browser; to be read when they have
  /// finished.
  Histogram lines;

 private:
  void show_data(std::uint16_t port, int browser) {
    tests::HttpClient client(port);
    const std::string machine = name_of_machine(
        static_cast<std::uint16_t>(1 + browser % static_cast<int>(machines_with_data)));
    for (int asked = 0; !over_; ++asked) {
      const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(
          now().time_since_epoch() - 2 * between_lines);
      std::string target = "/api/data/history?machine=" + machine;
      for (int i = 0; i < lines_of_a_browser; ++i) {
        target += fmt::format("&variable=1/axes/V.A.ACT_POS.X{}&since={}",
                              (browser + i) % variables, asked == 0 ? 0 : since.count());
      }
      const auto begun = Clock::now();
      bytes_ += client.get(target).body.size();
      {
        const std::scoped_lock lock(lines_mutex_);
        lines.add(Clock::now() - begun);
      }
      if (asked % lines_a_table == 0) {
        bytes_ += client.get("/api/data?elements=16&machine=" + machine).body.size();
        bytes_ += client.get("/api/programs/runs?limit=100&machine=" + machine).body.size();
        bytes_ += client.get("/api/data/machines").body.size();
      }
      std::this_thread::sleep_for(between_lines);
    }
  }
  void measure(const std::string& data) {
    const fabric::Time received = now();
    const auto changes = boost::json::parse(data);
    const auto* calls = changes.as_object().if_contains("calls");
    if (calls == nullptr) {
      return;
    }
    for (const auto& call : calls->as_array()) {
      const auto ended = base::text::parse_time(call.at("ended").as_string().c_str(), received);
      if (ended) {
        delays.add(received - *ended);
      }
    }
  }

  std::mutex lines_mutex_;
  std::atomic<bool> over_ = false;
  std::atomic<std::uint64_t> bytes_ = 0;
  std::vector<std::thread> threads_;
};

double ms(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

template <typename Value>
void put(int fd, Value value) {
  if (::write(fd, &value, sizeof value) != static_cast<ssize_t>(sizeof value)) {
    throw std::runtime_error("the process of the browsers has ended");
  }
}
template <typename Value>
Value get(int fd) {
  Value value{};
  if (::read(fd, &value, sizeof value) != static_cast<ssize_t>(sizeof value)) {
    throw std::runtime_error("the process of the browsers has ended");
  }
  return value;
}

}  // namespace

void print_times(const char* what, const char* things, const Histogram& times) {
  fmt::print("{:<28} {:>7} {}  p50 {:8.3f} ms  p99 {:8.3f} ms\n", what, times.count(), things,
             ms(times.percentile(0.5)), ms(times.percentile(0.99)));
}

BrowserProcess::BrowserProcess(int count, int with_data) {
  // The other programs must not keep them open.
  if (::pipe2(to_.data(), O_CLOEXEC) != 0 || ::pipe2(from_.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe");
  }
  pid_ = ::fork();
  if (pid_ == 0) {
    ::close(to_[1]);
    serve(count, with_data);
    ::_exit(0);
  }
  ::close(to_[0]);
}

BrowserProcess::~BrowserProcess() {
  ::close(to_[1]);
  ::waitpid(pid_, nullptr, 0);
}

void BrowserProcess::start(std::uint16_t port) const {
  put(to_[1], port);
}

std::uint64_t BrowserProcess::bytes() const {
  put(to_[1], std::uint16_t{0});
  return get<std::uint64_t>(from_[0]);
}

void BrowserProcess::finish() {
  ::close(std::exchange(to_[1], -1));
  ::waitpid(pid_, nullptr, 0);
}

void BrowserProcess::serve(int count, int with_data) {
  constexpr int gives_way = 15;
  static_cast<void>(::nice(gives_way));
  std::optional<Browsers> browsers;
  std::uint16_t asked = 0;
  while (::read(to_[0], &asked, sizeof asked) == static_cast<ssize_t>(sizeof asked)) {
    if (asked != 0) {
      browsers.emplace(asked, count, with_data);
    } else {
      put(from_[1], browsers->bytes());
    }
  }
  if (browsers) {
    browsers->finish();
    print_times("event in a browser after", "calls", browsers->delays);
    print_times("lines of machine data", "times", browsers->lines);
    std::fflush(stdout);
  }
}

}  // namespace millrace::bench

namespace millrace::bench {
namespace {

void measure(double seconds, int count, double rate, int with_data) {
  BrowserProcess browsers(count, with_data);
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  tests::Process service({tests::binary("millrace-square-root"), "--domain", number,
                          "--concurrency", "4", "--log-level", "error"});
  service.await("^ready: ");
  BusyPlant plant(domain.number(), 1);
  plant.run(1, rate);
  print_times("without millrace web", "calls", plant.run(seconds, rate));

  tests::Process web(
      {tests::binary("millrace"), "web", "--listen", "127.0.0.1:0", "--domain", number});
  const auto port =
      static_cast<std::uint16_t>(std::stoi(web.await("^ready: .*127\\.0\\.0\\.1:(\\d+)/").at(1)));
  browsers.start(port);
  plant.run(2, rate);
  const double before = processor_seconds(web.pid());
  const std::uint64_t bytes = browsers.bytes();
  const auto begun = Clock::now();
  print_times("with it and its browsers", "calls", plant.run(seconds, rate));
  const std::chrono::duration<double> took = Clock::now() - begun;
  const double used = processor_seconds(web.pid()) - before;
  const double read = static_cast<double>(browsers.bytes() - bytes);
  const double resident = resident_mib(web.pid());
  std::fflush(stdout);
  web.terminate();
  web.wait();
  browsers.finish();
  fmt::print(
      "{} browsers, {} of them with machine data: {:.1f} % of a core, {:.1f} MiB, {:.2f} MB/s to "
      "each\n",
      count, with_data, 100 * used / took.count(), resident, read / took.count() / count / 1e6);
}

}  // namespace
}  // namespace millrace::bench

int main(int argc, char** argv) {
  try {
    millrace::bench::measure(argc > 1 ? std::atof(argv[1]) : 10, argc > 2 ? std::atoi(argv[2]) : 50,
                             argc > 3 ? std::atof(argv[3]) : 1000,
                             argc > 4 ? std::atoi(argv[4]) : 10);
  } catch (const std::exception& error) {
    fmt::print(stderr, "web_load: {}\n", error.what());
    return 2;
  }
  return 0;
}
