// The cost of machine data and its effect on calls: 4 virtual CNCs with 100 changing variables
// each, sampled ten times a second by one gateway and stored by an archiver; compared with the same
// gateway without data.
//
//   data_load [SECONDS [CALLS]]
//
// Prints the processor time of gateway and archiver as a share of a core, the values in the
// archive, and p50 and p99 of calls in a second channel of each machine, with data and without,
// three times in turns. Exit code 1 if the gateway takes more than 15 % for the data, the archiver
// more than 10 %, or a call with data more than 1.2 times as long as without.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/process_use.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace millrace;
using tests::binary;
using tests::Process;

constexpr int machines = 4;
constexpr int variables = 100;
constexpr const char* square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// Each variable changes to another number every 50 ms.
std::string counting_program() {
  std::string text = "%counting\nP1 = 0\n$WHILE 1\n  P1 = P1 + 0.125\n";
  for (int i = 0; i < variables; ++i) {
    text += fmt::format("  V.E.N{} = P1\n", i);
  }
  return text + "  #TIME 0.05\n$ENDWHILE\nM30\n";
}

std::string calling_program(int calls) {
  return fmt::format(
      "%calling\nV.G.SERVICE.UUID = \"{}\"\nP1 = 1\n$WHILE P1 <= {}\n"
      "  V.G.SERVICE.REQUEST = \"2\"\n  V.G.SERVICE.REQUEST_STATE = P1\n  #FLUSH CONTINUE\n"
      "  #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\n  P1 = P1 + 1\n$ENDWHILE\n"
      "#MSG [\"%d calls answered\", P1 - 1]\nM30\n",
      square_root, calls);
}

std::string cnc_configuration() {
  std::string text = "channels: 2\n";
  for (int i = 0; i < variables; ++i) {
    text += fmt::format(
        "external_variable {{ name: \"N{}\" type: REAL64 synchronisation: false }}\n", i);
  }
  return text;
}

struct Plant {
  explicit Plant(int number_of_calls) : calls(number_of_calls) {
    write("cnc.textproto", cnc_configuration());
    write("counting.nc", counting_program());
    write("calling.nc", calling_program(calls));
    write("archiver.textproto", "folder: \"archive\"\n");
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder.path() / name) << text;
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }

  /// The first channel of each machine counts; the second one calls if `with_calls`.
  std::vector<Process> start_machines(bool with_calls) {
    std::vector<Process> all;
    ports.clear();
    for (int i = 0; i < machines; ++i) {
      std::vector<std::string> command{binary("millrace-cnc"),
                                       "--listen",
                                       "127.0.0.1:0",
                                       "--config",
                                       path("cnc.textproto"),
                                       "--timings",
                                       "--dir",
                                       folder.path().string(),
                                       "--run",
                                       "1=" + path("counting.nc")};
      if (with_calls) {
        command.insert(command.end(), {"--run", "2=" + path("calling.nc")});
      }
      all.emplace_back(std::move(command));
      ports.push_back(all.back().await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1));
    }
    return all;
  }

  Process start_gateway(bool with_data) {
    std::string text;
    for (int i = 0; i < machines; ++i) {
      text += fmt::format(
          "machine {{ name: \"m{}\" host: \"127.0.0.1\" port: {} net_id: \"127.0.0.1.1.1\"\n", i,
          ports[static_cast<std::size_t>(i)]);
      if (with_data) {
        text += "  data { name: \"all\" period_ms: 100\n";
        for (int v = 0; v < variables; ++v) {
          text += fmt::format("    variable: \"V.E.N{}\"\n", v);
        }
        text += "  }\n";
      }
      text += "}\n";
    }
    write("gateway.textproto", text);
    Process gateway({binary("millrace-gateway"), "--domain", std::to_string(domain.number()),
                     "--config", path("gateway.textproto"), "--no-journal"});
    gateway.await("^ready: ");
    return gateway;
  }

  Process start(const std::string& name, std::vector<std::string> flags = {}) const {
    std::vector<std::string> command{binary(name), "--domain", std::to_string(domain.number())};
    command.insert(command.end(), flags.begin(), flags.end());
    Process process(std::move(command));
    process.await("^ready: ");
    return process;
  }

  int calls;
  tests::Domain domain;
  tests::TemporaryFolder folder;
  std::vector<std::string> ports;
};

double share(const Process& process, double before, double seconds) {
  return 100 * (bench::processor_seconds(process.pid()) - before) / seconds;
}

struct Cost {
  double gateway = 0;
  double archiver = 0;
};

Cost measure_cost(Plant& plant, bool with_data, double seconds) {
  const std::vector<Process> cncs = plant.start_machines(false);
  const Process archiver =
      plant.start("millrace-archiver", {"--config", plant.path("archiver.textproto")});
  const Process gateway = plant.start_gateway(with_data);
  // Start-up work is not measured.
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const double gateway_before = bench::processor_seconds(gateway.pid());
  const double archiver_before = bench::processor_seconds(archiver.pid());
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  return {share(gateway, gateway_before, seconds), share(archiver, archiver_before, seconds)};
}

/// Rows of samples in the archive.
std::size_t archived(const Plant& plant) {
  Process query({binary("millrace-archiver"), "query", "--folder", plant.path("archive"), "--kind",
                 "sample"});
  query.wait(std::chrono::minutes(2));
  const std::string rows = query.output();
  return static_cast<std::size_t>(std::ranges::count(rows, '\n')) - 1;
}

void add_calls(Plant& plant, bool with_data, bench::Series& times) {
  std::vector<Process> cncs = plant.start_machines(true);
  const Process service = plant.start("millrace-square-root");
  const Process gateway = plant.start_gateway(with_data);
  const std::regex line("\\[ch2\\] call \\d+: .*: ([0-9.]+) ms");
  for (Process& cnc : cncs) {
    cnc.await("calls answered", std::chrono::minutes(5));
    cnc.terminate();
    cnc.wait();
    std::istringstream out(cnc.output());
    // The first program waits for the gateway.
    bool first = true;
    for (std::string text; std::getline(out, text);) {
      std::smatch found;
      if (std::regex_search(text, found, line) && !std::exchange(first, false)) {
        times.add_microseconds(1000 * std::stod(found[1]));
      }
    }
  }
}

/// Prints a quantile of both and returns whether the goal is met.
bool compare_calls(const char* name, double share, bench::Series& with, bench::Series& without) {
  if (with.empty() || without.empty()) {
    throw std::runtime_error("no call was answered");
  }
  constexpr double goal = 1.2;
  const double ratio = with.quantile(share) / without.quantile(share);
  fmt::print("calls     {} {:.2f} ms with data, {:.2f} ms without: ratio {:.2f}   goal: {}\n", name,
             with.quantile(share) / 1000, without.quantile(share) / 1000, ratio, goal);
  return ratio <= goal;
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 10;
  const int calls = argc > 2 ? std::atoi(argv[2]) : 1000;
  Plant plant(calls);
  const Cost without = measure_cost(plant, false, seconds);
  const Cost with = measure_cost(plant, true, seconds);
  const std::size_t rows = archived(plant);
  // In turns, so that other load on the host affects both.
  constexpr int rounds = 3;
  bench::Series calls_without;
  bench::Series calls_with;
  for (int round = 0; round < rounds; ++round) {
    add_calls(plant, false, calls_without);
    add_calls(plant, true, calls_with);
  }
  fmt::print("{} machines x {} variables at 10 Hz, {} rows archived\n", machines, variables, rows);
  fmt::print("gateway   {:6.1f} % of a core with data, {:.1f} % without   goal: at most 15 more\n",
             with.gateway, without.gateway);
  fmt::print("archiver  {:6.1f} % of a core with data, {:.1f} % without   goal: at most 10\n",
             with.archiver, without.archiver);
  const bool half = compare_calls("p50", 0.5, calls_with, calls_without);
  const bool slow = compare_calls("p99", 0.99, calls_with, calls_without);
  const bool cheap = with.gateway - without.gateway <= 15 && with.archiver <= 10;
  return cheap && half && slow ? 0 : 1;
}
