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
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include <fmt/format.h>

#include "tests/bench/process_use.hpp"
#include "tests/bench/web/browsers.hpp"
#include "tests/bench/web/busy_plant.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"

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
