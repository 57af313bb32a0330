#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::bench {

namespace {

using tests::Process;
using Flags = std::vector<std::string>;

constexpr std::chrono::seconds long_patience{120};

/// A virtual CNC with its gateway or services.
class Bench {
 public:
  /// The gateway uses plain ADS, or Secure ADS with a pre-shared key.
  explicit Bench(bool secure = false) : secure_(secure) {}

  /// With `pauses` a program waits 20 to 40 ms after each answer, so that requests come at varying
  /// moments of a polling period.
  Process cnc(std::size_t channels, std::size_t calls, bool pauses = false) {
    const auto program = folder_.path() / "calls.nc";
    std::ofstream(program) << fmt::format(
        "%calls\nN10 V.G.SERVICE.UUID = \"{}\"\nN20 P1 = 1\nN25 P2 = 20\nN30 $WHILE P1 <= {}\n"
        "N40   V.G.SERVICE.REQUEST = \"2.0000000000\"\nN50   V.G.SERVICE.REQUEST_STATE = P1\n"
        "N60   #FLUSH CONTINUE\nN70   #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\n"
        "{}N80   P1 = P1 + 1\nN90 $ENDWHILE\nN100 M30\n",
        bench_uuid, calls,
        pauses ? "N71   P2 = P2 + 3.7\nN72   $IF P2 > 40\nN73     P2 = P2 - 20\nN74   $ENDIF\n"
                 "N75   #TIME [P2 / 1000]\nN76   #FLUSH WAIT\n"
               : "");
    Flags command{tests::binary("millrace-cnc"), "--listen", "127.0.0.1:0", "--channels",
                  std::to_string(channels),      "--dir",    folder_.path()};
    for (std::size_t channel = 1; calls > 0 && channel <= channels; ++channel) {
      command.insert(command.end(), {"--run", fmt::format("{}={}", channel, program.string())});
    }
    if (calls > 0) {
      command.insert(command.end(), {"--exit-when-idle", "--timings"});
    }
    if (secure_) {
      command.insert(command.end(), {"--config", write("cnc.textproto",
                                                       "secure_ads { listen: '127.0.0.1:0' psk { "
                                                       "identity: 'millrace' password: 'secret' "
                                                       "} }")});
    }
    Process process(command);
    const std::string place = secure_ ? "Secure ADS at" : "on";
    port_ = process.await("^ready: .* " + place + " 127\\.0\\.0\\.1:(\\d+)", long_patience).at(1);
    return process;
  }

  Process gateway(const std::string& configuration) {
    write("cnc.psk", "secret");
    Process process({tests::binary("millrace-gateway"), "--domain",
                     std::to_string(domain_.number()), "--config",
                     write("gateway.textproto", configuration), "--no-journal", "--log-level",
                     "warn"});
    process.await("^ready", long_patience);
    return process;
  }

  [[nodiscard]] std::string machine(const std::string& name, const std::string& rest) const {
    return fmt::format(
        "machine {{ name: \"{}\" host: \"127.0.0.1\" port: {} net_id: \"127.0.0.1.1.1\" {} {} }}\n",
        name, port_, rest,
        secure_ ? "secure { psk { identity: 'millrace' password_file: 'cnc.psk' } }" : "");
  }

  [[nodiscard]] PeerOptions peer(const std::string& kind) const {
    PeerOptions options;
    options.kind = kind;
    options.domain = domain_.number();
    options.port = static_cast<std::uint16_t>(std::stoi(port_));
    return options;
  }

 private:
  std::string write(const std::string& name, const std::string& text) {
    const auto file = folder_.path() / name;
    std::ofstream(file) << text;
    std::filesystem::permissions(file, std::filesystem::perms(0640));
    return file;
  }

  bool secure_;
  tests::Domain domain_;
  tests::TemporaryFolder folder_;
  std::string port_ = "1";
};

/// "1, 2, 3": by default a gateway does not search more than 32 channels.
std::string first(std::size_t channels) {
  std::string list;
  for (std::size_t channel = 1; channel <= channels; ++channel) {
    list += fmt::format("{}{}", list.empty() ? "" : ", ", channel);
  }
  return list;
}

/// The times that --timings printed, except the first of each channel, which waited for a start.
Series timings(const std::string& output) {
  Series series;
  const std::regex line("call (\\d+): [^\\n]*: ([0-9.]+) ms");
  for (std::sregex_iterator it(output.begin(), output.end(), line), end; it != end; ++it) {
    if (it->str(1) != "1") {
      series.add_microseconds(1000 * std::stod(it->str(2)));
    }
  }
  return series;
}

/// The mean of the "requests N" lines except the first.
double mean_requests(const std::string& output) {
  double sum = 0;
  int count = -1;
  const std::regex line("requests (\\d+)");
  for (std::sregex_iterator it(output.begin(), output.end(), line), end; it != end; ++it, ++count) {
    sum += count >= 0 ? std::stod(it->str(1)) : 0;
  }
  return count > 0 ? sum / count : 0;
}

/// From the gateway's own statistics.
double requests_per_second(const Bench& bench) {
  Process machines({tests::binary("millrace"), "machines", "--json", "--domain",
                    std::to_string(bench.peer("").domain)});
  machines.wait(long_patience);
  std::smatch found;
  const std::string output = machines.output();
  const std::regex pattern("\"requests_per_second\":(\\d+)");
  return std::regex_search(output, found, pattern) ? std::stod(found.str(1)) : 0;
}

Series program_with_gateway(std::size_t calls, const std::string& machine, bool pauses = false,
                            bool secure = false) {
  Bench bench(secure);
  const Process service = start_peer(bench.peer("inline"));
  Process cnc = bench.cnc(1, calls, pauses);
  const Process gateway = bench.gateway(bench.machine("cnc", machine));
  cnc.wait(long_patience);
  return timings(cnc.output());
}

Series program_with_polling(std::size_t calls, std::uint32_t period, bool pauses = false) {
  Bench bench;
  Process cnc = bench.cnc(1, calls, pauses);
  PeerOptions options = bench.peer("polling");
  options.period_ms = period;
  const Process service = start_peer(options);
  cnc.wait(long_patience);
  return timings(cnc.output());
}

}  // namespace

namespace {

/// A gateway with notifications, against a service that polls every 10 ms. Each line ends with its
/// ratio.
bool measure_push() {
  constexpr std::size_t calls = 300;
  constexpr std::size_t rounds = 3;
  constexpr std::uint32_t period = 10;
  constexpr double goal = 0.2;
  bool met = true;
  for (const bool pauses : {true, false}) {
    Series through_gateway;
    Series by_polling;
    for (std::size_t round = 0; round < rounds; ++round) {
      by_polling.add(program_with_polling(calls, period, pauses));
      through_gateway.add(program_with_gateway(calls, "", pauses));
    }
    const double ratio = through_gateway.median() / by_polling.median();
    fmt::print(
        "push, {:<22} polling service {:.2f} (p99 {:.2f})   gateway {:.2f} (p99 {:.2f})   {}   "
        "ratio {:.2f}\n",
        pauses ? "from idle:" : "one after the other:", by_polling.median() / 1000,
        by_polling.p99() / 1000, through_gateway.median() / 1000, through_gateway.p99() / 1000,
        verdict(ratio, goal, true), ratio);
    met = met && ratio <= goal;
  }
  return met;
}

/// ADS requests per second of an idle machine of ten channels with notifications.
bool measure_pushed_load() {
  constexpr std::size_t channels = 10;
  constexpr double goal = 5;
  Bench bench;
  const Process cnc = bench.cnc(channels, 0);
  const Process gateway = bench.gateway(bench.machine("cnc", ""));
  std::this_thread::sleep_for(std::chrono::seconds(5));
  const double requests = requests_per_second(bench);
  fmt::print("push, {} idle channels: {:.0f} ADS requests per second   {}\n", channels, requests,
             verdict(requests, goal, true));
  return requests > 0 && requests <= goal;
}

}  // namespace

bool measure_program() {
  constexpr std::size_t calls = 500;
  constexpr std::size_t rounds = 3;
  constexpr double goal = 1.1;
  bool met = true;
  fmt::print("NC program writes REQUEST_STATE -> sees RESPONSE_STATE, ms, {} x {} calls\n", rounds,
             calls);
  for (const std::uint32_t period : {2U, 10U}) {
    Series through_gateway;
    Series by_polling;
    for (std::size_t round = 0; round < rounds; ++round) {
      by_polling.add(program_with_polling(calls, period));
      through_gateway.add(program_with_gateway(
          calls, fmt::format("watch: POLL poll {{ active_ms: {} idle_ms: {} }}", period, period)));
    }
    fmt::print(
        "  period {:>2} ms   polling service {:.2f} (p99 {:.2f})   gateway {:.2f} (p99 "
        "{:.2f})   ratio {:.2f}   {}\n",
        period, by_polling.median() / 1000, by_polling.p99() / 1000,
        through_gateway.median() / 1000, through_gateway.p99() / 1000,
        through_gateway.median() / by_polling.median(),
        verdict(through_gateway.median() / by_polling.median(), goal, true));
    met = met && through_gateway.median() <= goal * by_polling.median();
  }
  return measure_push() && met;
}

bool measure_controller_load() {
  constexpr std::uint32_t services = 20;
  constexpr std::uint32_t channels = 10;
  constexpr std::uint32_t period = 10;
  constexpr auto time = std::chrono::seconds(5);
  double of_polling = 0;
  {
    Bench bench;
    const Process cnc = bench.cnc(channels, 0);
    PeerOptions options = bench.peer("polling");
    options.number = services;
    options.channels = channels;
    options.period_ms = period;
    Process peer = start_peer(options);
    std::this_thread::sleep_for(time);
    of_polling = mean_requests(peer.output());
  }
  Bench bench;
  const Process cnc = bench.cnc(channels, 0);
  std::vector<Process> instances;
  for (std::uint32_t i = 0; i < services; ++i) {
    instances.push_back(start_peer(bench.peer("inline")));
  }
  const Process gateway = bench.gateway(bench.machine("cnc", "watch: POLL poll { idle_ms: 10 }"));
  std::this_thread::sleep_for(time);
  const double of_gateway = requests_per_second(bench);
  fmt::print("ADS requests per second, {} services, {} channels, every {} ms\n", services, channels,
             period);
  fmt::print("  polling services {:.0f}   gateway {:.0f}   ratio 1/{:.1f}   {}\n", of_polling,
             of_gateway, of_polling / of_gateway, verdict(of_gateway / of_polling, 1.0 / 15, true));
  return measure_pushed_load() && of_gateway > 0 && of_gateway * 15 <= of_polling;
}

bool measure_idle() {
  constexpr double memory_goal = 64;
  constexpr double processor_goal = 3;
  double memory = 0;
  {
    // Four machines of 250 channels: one CNC has at most 255.
    constexpr int machines = 4;
    std::vector<Bench> benches(machines);
    std::vector<Process> cncs;
    std::string configuration;
    for (int i = 0; i < machines; ++i) {
      Bench& bench = benches[static_cast<std::size_t>(i)];
      cncs.push_back(bench.cnc(250, 0));
      configuration += bench.machine(
          fmt::format("cnc{}", i),
          fmt::format("channel: [{}] watch: POLL poll {{ idle_ms: 100 }}", first(250)));
    }
    const Process gateway = benches.front().gateway(configuration);
    std::this_thread::sleep_for(std::chrono::seconds(5));
    memory = resident_mib(gateway.pid());
  }
  Bench bench;
  const Process cnc = bench.cnc(10, 0);
  const auto percent_of = [&](const std::string& watch) {
    const Process gateway = bench.gateway(bench.machine("cnc", watch));
    std::this_thread::sleep_for(std::chrono::seconds(2));
    constexpr auto time = std::chrono::seconds(10);
    const double before = processor_seconds(gateway.pid());
    const double cnc_before = processor_seconds(cnc.pid());
    std::this_thread::sleep_for(time);
    const double seconds = std::chrono::duration<double>(time).count();
    return std::pair(100 * (processor_seconds(gateway.pid()) - before) / seconds,
                     100 * (processor_seconds(cnc.pid()) - cnc_before) / seconds);
  };
  const double percent = percent_of("watch: POLL poll { idle_ms: 4 active_ms: 4 }").first;
  const auto pushed = percent_of("");
  fmt::print("gateway, 1,000 channels: {:.1f} MiB resident   {}\n", memory,
             verdict(memory, memory_goal, true));
  fmt::print("gateway, 10 idle channels every 4 ms: {:.1f} % of a core   {}\n", percent,
             verdict(percent, processor_goal, true));
  fmt::print("gateway, 10 idle channels, pushed: {:.1f} % of a core; the virtual CNC {:.1f} %\n",
             pushed.first, pushed.second);
  return memory <= memory_goal && percent <= processor_goal;
}

/// A gateway's memory with this many machines of one controller, all connected.
double memory_with_machines(std::size_t machines, bool secure) {
  Bench bench(secure);
  const Process cnc = bench.cnc(1, 0);
  std::string configuration;
  for (std::size_t number = 1; number <= machines; ++number) {
    configuration +=
        bench.machine(fmt::format("cnc{}", number),
                      fmt::format("channel: 1 source_net_id: \"127.0.0.2.{}.1\"", number));
  }
  const Process gateway = bench.gateway(configuration);
  std::this_thread::sleep_for(std::chrono::seconds(5));
  return resident_mib(gateway.pid());
}

bool measure_secure_gateway() {
  constexpr std::size_t calls = 300;
  constexpr std::size_t rounds = 3;
  constexpr double call_goal = 1.15;
  constexpr std::size_t machines = 100;
  constexpr double memory_goal = 150;
  Series plain;
  Series secure;
  for (std::size_t round = 0; round < rounds; ++round) {
    plain.add(program_with_gateway(calls, "", true));
    secure.add(program_with_gateway(calls, "", true, true));
  }
  const double ratio = secure.median() / plain.median();
  fmt::print(
      "call, push from idle, ms: plain ADS {:.2f} (p99 {:.2f})   Secure ADS {:.2f} (p99 {:.2f})   "
      "ratio {:.2f}   {}\n",
      plain.median() / 1000, plain.p99() / 1000, secure.median() / 1000, secure.p99() / 1000, ratio,
      verdict(ratio, call_goal, true));
  const double more =
      (memory_with_machines(machines, true) - memory_with_machines(machines, false)) * 1024 /
      static_cast<double>(machines);
  fmt::print("memory of a gateway for each secured machine, of {}: {:.0f} KiB more   {}\n",
             machines, more, verdict(more, memory_goal, true));
  return ratio <= call_goal && more <= memory_goal;
}

namespace {

/// Seconds from the start of a gateway until each channel of a virtual CNC has made its calls.
double seconds_over_ads(std::size_t channels, std::size_t calls) {
  Bench bench;
  std::vector<Process> instances;
  for (int i = 0; i < 4; ++i) {
    PeerOptions options = bench.peer("inline");
    options.concurrency = 64;
    instances.push_back(start_peer(options));
  }
  Process cnc = bench.cnc(channels, calls);
  const auto start = Clock::now();
  const Process gateway =
      bench.gateway(bench.machine("cnc", fmt::format("channel: [{}]", first(channels))));
  cnc.wait(long_patience);
  const std::chrono::duration<double> took = Clock::now() - start;
  return took.count();
}

}  // namespace

void measure_over_ads(std::size_t channels) {
  constexpr std::size_t few = 20;
  constexpr std::size_t many = 100;
  // Without the time to connect and to discover the services.
  const double took = seconds_over_ads(channels, many) - seconds_over_ads(channels, few);
  fmt::print("  the same with {} channels of a virtual CNC over ADS: {:.0f} calls/s\n", channels,
             static_cast<double>(channels * (many - few)) / took);
}

}  // namespace millrace::bench
