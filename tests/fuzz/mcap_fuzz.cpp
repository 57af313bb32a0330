// The reader of recordings on any bytes: it does not crash, and repair saves a complete file with
// the same messages.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "tools/mcap/repair.hpp"
#include "tools/mcap/scan.hpp"
#include "tools/mcap/summary.hpp"

namespace {

using namespace millrace::tools;

class Collector : public mcap::Visitor {
 public:
  void on_message(const mcap::Channel&, const mcap::Message& message, std::uint64_t) override {
    messages.emplace_back(message.data);
  }
  void on_problem(const mcap::Problem&) override { ++problems; }

  std::vector<std::string> messages;
  std::size_t problems = 0;
};

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mcap::Memory damaged(std::string(reinterpret_cast<const char*>(data), size));
  (void)mcap::survey(damaged);
  mcap::Memory repaired;
  const auto report = mcap::repair(damaged, repaired, "fuzz");

  const auto summary = mcap::read_summary(damaged);
  Collector before;
  mcap::scan(damaged, summary ? summary->definitions : mcap::Definitions{}, before);
  if (!report) {
    // Repair makes no recording of a file that is not one.
    require(before.messages.empty());
    return 0;
  }
  const auto repaired_summary = mcap::read_summary(repaired);
  require(repaired_summary.has_value());
  require(repaired_summary->statistics == report->saved);
  Collector after;
  require(mcap::scan(repaired, repaired_summary->definitions, after));
  require(after.messages == before.messages);
  require(after.problems == 0);
  return 0;
}
