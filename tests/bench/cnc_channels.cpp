// How well millrace-cnc keeps its interpolator cycle of 1 ms while many channels run programs, and
// the share of a core it uses. A late cycle begins a whole period late.
//
//   cnc_channels [SECONDS [CHANNELS]]
//
// Three kinds of programs: motion, blocks that wait for a service, and loops without motion, which
// must not starve the others. Prints a table; exit code 1 if more than one cycle in a hundred was
// late.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/process_use.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using millrace::bench::processor_seconds;
using millrace::tests::binary;
using millrace::tests::Process;
using millrace::tests::TemporaryFolder;
using Seconds = std::chrono::duration<double>;

struct Workload {
  const char* name;
  const char* program;
};
constexpr Workload workloads[] = {
    {"motion, 30 ms a block",
     "G91 F6000\n$WHILE TRUE\nG01 X3\nG02 X3 I1.5\nG01 X-6\n$ENDWHILE\nM30\n"},
    {"waiting for services",
     "V.G.SERVICE.REQUEST_STATE = 1\n#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\nM30\n"},
    {"endless loops", "P1 = 0\n$WHILE TRUE\nP1 = P1 + 1\n$ENDWHILE\nM30\n"},
};

struct Counts {
  std::uint64_t late = 0;
  std::uint64_t done = 0;
  double worst = 0;
  /// Of one core.
  double cpu_share = 0;
};

Counts run(const Workload& workload, int channels, Seconds duration) {
  const TemporaryFolder folder;
  const auto program = folder.path() / "load.nc";
  std::ofstream(program) << workload.program;
  std::vector<std::string> command{
      binary("millrace-cnc"), "--listen",   "127.0.0.1:0",           "--dir",
      folder.path().string(), "--channels", std::to_string(channels)};
  for (int channel = 1; channel <= channels; ++channel) {
    command.push_back(fmt::format("--run={}={}", channel, program.string()));
  }
  Process cnc(command);
  cnc.await("^ready: ");
  const auto begin = std::chrono::steady_clock::now();
  const double used_before = processor_seconds(cnc.pid());
  std::this_thread::sleep_for(duration);
  const Seconds passed = std::chrono::steady_clock::now() - begin;
  const double used = processor_seconds(cnc.pid()) - used_before;
  cnc.terminate();
  cnc.wait();
  const std::string log = cnc.error_output();
  const std::regex line(
      R"((\d+) of (\d+) interpolator cycles were late, the worst by ([\d.]+) ms)");
  std::smatch found;
  if (!std::regex_search(log, found, line)) {
    throw std::runtime_error("no cycles were counted:\n" + log);
  }
  return {std::stoull(found[1]), std::stoull(found[2]), std::stod(found[3]), used / passed.count()};
}

}  // namespace

int main(int argc, char** argv) {
  const Seconds duration(argc > 1 ? std::max(std::atof(argv[1]), 1.0) : 10.0);
  const int channels = argc > 2 ? std::clamp(std::atoi(argv[2]), 1, 255) : 64;
  fmt::print("{} channels for {:.0f} s each, cycle of 1 ms\n", channels, duration.count());
  fmt::print("{:<26}{:>10}{:>8}{:>10}{:>12}{:>14}\n", "", "cycles", "late", "late", "worst, ms",
             "CPU, of 1 core");
  bool kept = true;
  for (const Workload& workload : workloads) {
    const Counts counts = run(workload, channels, duration);
    const double share = static_cast<double>(counts.late) / static_cast<double>(counts.done);
    fmt::print("{:<26}{:>10}{:>8}{:>9.2f}%{:>12.2f}{:>13.1f}%\n", workload.name, counts.done,
               counts.late, 100 * share, counts.worst, 100 * counts.cpu_share);
    kept = kept && share <= 0.01;
  }
  return kept ? EXIT_SUCCESS : EXIT_FAILURE;
}
