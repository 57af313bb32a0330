// What `millrace web` costs: browsers that are told of a plant which calls all the time.
//
//   web_load [SECONDS [BROWSERS [CALLS_PER_SECOND [WITH_DATA]]]]
//
// A gateway's side of the fabric with 20 machines of 10 channels, 100 values of each of 4 of them
// ten times a second, one service as a process of its own, `millrace web` as another, and as many
// browsers as are asked for, each of which reads all it is told. WITH_DATA of them (10 unless
// given) have the view of machine data open: six lines twice a second, all values and the programs
// of a machine every two seconds. Prints what a call takes without and with them, how long after
// its end a browser is told of a call, how long lines take, and what the web server uses.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/parse.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/text/times.hpp"
#include "fabric/ends/call_end.hpp"
#include "fabric/ends/data_end.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/http_client.hpp"
#include "tests/support/process.hpp"
#include "tests/support/run_until.hpp"
#include "tools/recording/histogram.hpp"

namespace {

using namespace millrace;
using Clock = std::chrono::steady_clock;
using tools::recording::Histogram;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
constexpr std::uint16_t machines = 20;
constexpr std::uint16_t channels = 10;
constexpr std::uint16_t machines_with_data = 4;
constexpr int variables = 100;
constexpr int lines_of_a_browser = 6;
constexpr auto between_samples = std::chrono::milliseconds(100);
constexpr auto between_lines = std::chrono::milliseconds(500);
/// The tables come with each fourth answer for the lines.
constexpr int lines_a_table = 4;

fabric::Time now() {
  return std::chrono::system_clock::now();
}

std::string name_of_machine(std::uint16_t machine) {
  return fmt::format("press-{}", machine);
}

/// A gateway of all machines that calls at a steady rate, in one channel after the other.
class Load : public fabric::ends::CallEndListener {
 public:
  Load(std::uint32_t domain, std::uint64_t epoch)
      : epoch_(epoch),
        tick_(io_),
        participant_({.domain = domain}),
        end_(participant_, io_.get_executor(), *this),
        data_(participant_),
        beat_(io_) {
    tell_data();
    for (std::uint16_t machine = 1; machine <= machines; ++machine) {
      publish(fabric::MachineStatus{.machine = name_of_machine(machine),
                                    .gateway = gateway_,
                                    .claimed = now(),
                                    .connected = true,
                                    .since = now(),
                                    .channels = channels,
                                    .host = "bench",
                                    .epoch = epoch_});
      for (std::uint16_t channel = 1; channel <= channels; ++channel) {
        free_.push_back({name_of_machine(machine), channel});
        tell(free_.back(), fabric::ChannelState::idle);
      }
    }
  }

  /// The times of the calls, from the request to its reply.
  Histogram run(double seconds, double calls_per_second) {
    if (!tests::run_until(io_, [this] { return instance_.has_value(); })) {
      throw std::runtime_error("no service is there");
    }
    times_ = {};
    sent_ = 0;
    calls_per_second_ = calls_per_second;
    begun_ = Clock::now();
    stop_at_ = begun_ +
               std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    keep_going();
    if (!tests::run_until(
            io_, [this] { return Clock::now() >= stop_at_ && open_.empty(); },
            std::chrono::seconds(600))) {
      throw std::runtime_error(fmt::format("{} calls were not answered", open_.size()));
    }
    return times_;
  }

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    instance_ = instance.id;
  }
  void on_instance_changed(const fabric::InstanceIdentity&) override {}
  void on_instance_gone(const fabric::InstanceId&) override {}
  void on_reply(const fabric::Reply& reply) override {
    const auto open = open_.find(reply.key);
    if (open == open_.end() || open->second.request.call != reply.call) {
      return;
    }
    times_.add(Clock::now() - open->second.begun);
    tell(open->second.request, fabric::EventKind::replied);
    tell(open->second.request, fabric::EventKind::written);
    tell(reply.key, fabric::ChannelState::idle);
    end_.withdraw(key_of(reply));
    open_.erase(open);
    free_.push_back(reply.key);
  }

 private:
  struct Open {
    fabric::Request request;
    Clock::time_point begun;
  };

  /// Every value is another one each time.
  void tell_data() {
    ++beats_;
    for (std::uint16_t machine = 1; machine <= machines_with_data; ++machine) {
      fabric::DataSample sample{.key = {name_of_machine(machine), 1},
                                .group = "axes",
                                .at = now(),
                                .period = between_samples,
                                .wanted = between_samples};
      for (int i = 0; i < variables; ++i) {
        sample.values.push_back({.name = fmt::format("V.A.ACT_POS.X{}", i),
                                 .type = fabric::ValueType::real64,
                                 .at = sample.at,
                                 .elements = std::vector<double>{beats_ * 0.125 + i}});
      }
      if (const auto published = data_.publish(sample); !published) {
        throw std::runtime_error(published.error());
      }
    }
    beat_.expires_after(between_samples);
    beat_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        tell_data();
      }
    });
  }

  void keep_going() {
    const auto time = Clock::now();
    const std::chrono::duration<double> passed = time - begun_;
    while (!free_.empty() && time < stop_at_ &&
           static_cast<double>(sent_) < calls_per_second_ * passed.count()) {
      const fabric::ChannelKey key = free_.front();
      free_.pop_front();
      call(key);
    }
    if (time < stop_at_) {
      tick_.expires_after(std::chrono::milliseconds(1));
      tick_.async_wait([this](const boost::system::error_code&) { keep_going(); });
    }
  }

  void call(const fabric::ChannelKey& key) {
    ++sent_;
    const fabric::Request request{.key = key,
                                  .call = {epoch_, ++number_},
                                  .assigned = *instance_,
                                  .uuid = uuid,
                                  .text = "2",
                                  .state = 1,
                                  .seen = now(),
                                  .dispatched = now()};
    open_.insert_or_assign(key, Open{request, Clock::now()});
    tell(request, fabric::EventKind::seen);
    tell(request, fabric::EventKind::dispatched);
    tell(key, fabric::ChannelState::running, request.call);
    publish(request);
  }

  void tell(const fabric::ChannelKey& key, fabric::ChannelState state, fabric::CallId call = {}) {
    fabric::ChannelStatus status{.key = key, .state = state, .since = now(), .call = call};
    if (call != fabric::CallId{}) {
      status.instance = *instance_;
      status.uuid = uuid;
    }
    publish(status);
  }
  void tell(const fabric::Request& request, fabric::EventKind kind) {
    publish(fabric::Event{.key = request.key,
                          .call = request.call,
                          .attempt = 1,
                          .kind = kind,
                          .at = now(),
                          .instance = *instance_,
                          .uuid = uuid,
                          .text = request.text,
                          .state = 1});
  }

  template <typename Sample>
  void publish(const Sample& sample) {
    if (const auto published = end_.publish(sample); !published) {
      throw std::runtime_error(published.error());
    }
  }

  std::uint64_t epoch_;
  std::uint64_t number_ = 0;
  std::uint64_t sent_ = 0;
  double calls_per_second_ = 0;
  fabric::InstanceId gateway_ = fabric::InstanceId::random();
  boost::asio::io_context io_;
  boost::asio::steady_timer tick_;
  std::deque<fabric::ChannelKey> free_;
  std::optional<fabric::InstanceId> instance_;
  std::map<fabric::ChannelKey, Open> open_;
  Histogram times_;
  Clock::time_point begun_{};
  Clock::time_point stop_at_{};
  fabric::dds::Participant participant_;
  fabric::ends::CallEnd end_;
  fabric::ends::DataEnd data_;
  boost::asio::steady_timer beat_;
  double beats_ = 0;
};

/// Browsers, each in a thread. The first one takes apart what it is told, the others read. Those
/// that show machine data have another thread that asks for it.
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

  /// Waits until each has heard something more, or the end.
  void finish() {
    over_ = true;
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

  /// From the end of a call to when it was heard of; to be read when they have finished.
  Histogram delays;
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// From the question to the answer for the lines of a browser; to be read when they have
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
    const fabric::Time heard = now();
    const auto changes = boost::json::parse(data);
    const auto* calls = changes.as_object().if_contains("calls");
    if (calls == nullptr) {
      return;
    }
    for (const auto& call : calls->as_array()) {
      const auto ended = base::text::parse_time(call.at("ended").as_string().c_str(), heard);
      if (ended) {
        delays.add(heard - *ended);
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

void print(const char* what, const Histogram& times) {
  fmt::print("{:<28} {:>7} calls  p50 {:8.3f} ms  p99 {:8.3f} ms\n", what, times.count(),
             ms(times.percentile(0.5)), ms(times.percentile(0.99)));
}

/// Browsers are on other hosts: here they are a process of their own, which gives way.
class BrowserProcess {
 public:
  /// To be made before there are threads.
  BrowserProcess(int count, int with_data) {
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
  ~BrowserProcess() {
    ::close(to_[1]);
    ::waitpid(pid_, nullptr, 0);
  }
  BrowserProcess(const BrowserProcess&) = delete;
  BrowserProcess& operator=(const BrowserProcess&) = delete;

  void start(std::uint16_t port) const { put(to_[1], port); }
  /// Bytes that all of them have read.
  [[nodiscard]] std::uint64_t bytes() const {
    put(to_[1], std::uint16_t{0});
    return get<std::uint64_t>(from_[0]);
  }
  /// Prints what they measured. The server has ended.
  void finish() {
    ::close(std::exchange(to_[1], -1));
    ::waitpid(pid_, nullptr, 0);
  }

 private:
  template <typename Value>
  static void put(int fd, Value value) {
    if (::write(fd, &value, sizeof value) != static_cast<ssize_t>(sizeof value)) {
      throw std::runtime_error("the process of the browsers is gone");
    }
  }
  template <typename Value>
  static Value get(int fd) {
    Value value{};
    if (::read(fd, &value, sizeof value) != static_cast<ssize_t>(sizeof value)) {
      throw std::runtime_error("the process of the browsers is gone");
    }
    return value;
  }

  void serve(int count, int with_data) {
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
      print("told to a browser after", browsers->delays);
      fmt::print("{:<28} {:>7} times  p50 {:8.3f} ms  p99 {:8.3f} ms\n", "lines of machine data",
                 browsers->lines.count(), ms(browsers->lines.percentile(0.5)),
                 ms(browsers->lines.percentile(0.99)));
      std::fflush(stdout);
    }
  }

  std::array<int, 2> to_{};
  std::array<int, 2> from_{};
  pid_t pid_ = -1;
};

void measure(double seconds, int count, double rate, int with_data) {
  BrowserProcess browsers(count, with_data);
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  tests::Process service({tests::binary("millrace-square-root"), "--domain", number,
                          "--concurrency", "4", "--log-level", "error"});
  service.await("^ready: ");
  Load load(domain.number(), 1);
  load.run(1, rate);
  print("without millrace web", load.run(seconds, rate));

  tests::Process web(
      {tests::binary("millrace"), "web", "--listen", "127.0.0.1:0", "--domain", number});
  const auto port =
      static_cast<std::uint16_t>(std::stoi(web.await("^ready: .*127\\.0\\.0\\.1:(\\d+)/").at(1)));
  browsers.start(port);
  load.run(2, rate);
  const double before = bench::processor_seconds(web.pid());
  const std::uint64_t bytes = browsers.bytes();
  const auto begun = Clock::now();
  print("with it and its browsers", load.run(seconds, rate));
  const std::chrono::duration<double> took = Clock::now() - begun;
  const double used = bench::processor_seconds(web.pid()) - before;
  const double read = static_cast<double>(browsers.bytes() - bytes);
  const double resident = bench::resident_mib(web.pid());
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

int main(int argc, char** argv) {
  try {
    measure(argc > 1 ? std::atof(argv[1]) : 10, argc > 2 ? std::atoi(argv[2]) : 50,
            argc > 3 ? std::atof(argv[3]) : 1000, argc > 4 ? std::atoi(argv[4]) : 10);
  } catch (const std::exception& error) {
    fmt::print(stderr, "web_load: {}\n", error.what());
    return 2;
  }
  return 0;
}
