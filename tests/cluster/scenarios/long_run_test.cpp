// I8: the resources of the programs do not grow with the number of calls.
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/types.h>

#include "tests/bench/process_use.hpp"
#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {

// The resources of a process, from /proc.

struct Resources {
  /// Resident memory.
  std::size_t bytes = 0;
  std::size_t threads = 0;
  std::size_t descriptors = 0;
};

/// Throws std::runtime_error if there is no such process.
Resources resources_of(pid_t process);

Resources resources_of(pid_t process) {
  const std::filesystem::path proc = "/proc/" + std::to_string(process);
  std::ifstream status(proc / "status");
  if (!status) {
    throw std::runtime_error("there is no process " + std::to_string(process));
  }
  Resources found;
  std::string name;
  while (status >> name) {
    if (name == "VmRSS:") {
      constexpr std::size_t kibibyte = 1024;
      status >> found.bytes;
      found.bytes *= kibibyte;
    } else if (name == "Threads:") {
      status >> found.threads;
    }
  }
  const std::filesystem::directory_iterator descriptors(proc / "fd");
  found.descriptors = static_cast<std::size_t>(std::distance(begin(descriptors), end(descriptors)));
  return found;
}

namespace {

constexpr std::uint32_t channels = 4;
constexpr std::uint32_t calls = 5000;
/// Buffers and tables have their final size by then.
constexpr std::size_t settled = 2000;
/// For the last 8,192 events, which a gateway keeps for a recorder that is late, at any time of the
/// run; then its allocator keeps the memory. Measured: from 30 to 54 MB, 2.9 kB an event with what
/// Cyclone adds; from 27 to 68 MB beside other work. A leak of 3 kB a call is more.
constexpr std::size_t slack = 48U << 20U;

class ALongRun : public Scenario {};

TEST_P(ALongRun, UsesNoMoreMemoryThreadsAndDescriptorsThanAtItsBeginning) {
  sut().service("service-1", "slow-1", {"--concurrency", "4"});
  sut().gateway();
  sut().cnc({.channels = channels, .calls = calls});
  sut().await_finished(settled, std::chrono::minutes(2));
  std::map<std::string, Resources> before;
  for (const char* name : {"gateway", "slow-1", "recorder", "cnc"}) {
    before[name] = resources_of(sut().task(name).pid());
  }
  constexpr std::size_t nearly_all = channels * calls - 100;
  sut().await_finished(nearly_all - std::min(nearly_all, sut().finished()),
                       std::chrono::minutes(2));
  for (const auto& [name, then] : before) {
    const pid_t process = sut().task(name).pid();
    const Resources now = resources_of(process);
    fmt::print("measured: {} {:.1f} MB after {} calls, {:.1f} MB after {}\n", name,
               static_cast<double>(then.bytes) / 1e6, settled, static_cast<double>(now.bytes) / 1e6,
               channels * calls - 100);
    if (!bench::keeps_what_is_freed) {
      EXPECT_LE(now.bytes, then.bytes + slack) << "I8: " << name;
    }
    EXPECT_EQ(now.threads, then.threads) << "I8: " << name;
    EXPECT_LE(now.descriptors, then.descriptors + 1) << "I8: " << name;
  }
  sut().expect_all_answered(std::chrono::minutes(1));
}

INSTANTIATE_TEST_SUITE_P(Cluster, ALongRun, testing::ValuesIn(backends), name_of);

}  // namespace

}  // namespace millrace::tests::cluster
