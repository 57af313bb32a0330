#include "tests/bench/gateway/fleet.hpp"

#include <algorithm>
#include <stdexcept>

#include "tests/bench/process_use.hpp"

namespace millrace::bench {

Fleet::Fleet(const PeerOptions& each, std::uint32_t instances, std::uint32_t processes) {
  PeerOptions options = each;
  for (std::uint32_t i = 0; i < processes; ++i) {
    // Spread as evenly as possible.
    options.count = instances / processes + (i < instances % processes ? 1 : 0);
    processes_.push_back(launch_peer(options));
    options.number += options.count;
  }
  started_ = Clock::now();
}

bool Fleet::await_ready(std::chrono::milliseconds limit) {
  const auto end = Clock::now() + limit;
  try {
    for (tests::Process& process : processes_) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
      process.await("^ready", std::max(left, std::chrono::milliseconds(0)));
    }
  } catch (const std::runtime_error&) {
    return false;
  }
  return true;
}

double Fleet::processor_seconds() const {
  double seconds = 0;
  for (const tests::Process& process : processes_) {
    seconds += bench::processor_seconds(process.pid());
  }
  return seconds;
}

std::string Fleet::problem() const {
  for (const tests::Process& process : processes_) {
    if (std::string errors = process.error_output(); !errors.empty()) {
      return errors;
    }
  }
  return {};
}

std::vector<int> Fleet::ended() {
  std::vector<int> codes;
  for (tests::Process& process : processes_) {
    if (!process.running()) {
      codes.push_back(process.wait());
    }
  }
  return codes;
}

}  // namespace millrace::bench
