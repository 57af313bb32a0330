// millrace-dial-gauge: reads wireless dial gauges, and simulates them.
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "services/dial_gauge/running_gauges.hpp"
#include "services/sdk/command_line.hpp"

namespace {

using namespace millrace;
namespace sdk = services::sdk;
namespace dial_gauge = services::dial_gauge;

dial_gauge::Config configuration(const std::string& file) {
  if (file.empty()) {
    return dial_gauge::demonstration(std::filesystem::current_path());
  }
  auto config = dial_gauge::load(file);
  if (!config) {
    throw base::program::UsageError(config.error());
  }
  return *std::move(config);
}

}  // namespace

int main(int argc, char** argv) {
  if (base::program::asks_for_check(argc, argv)) {
    return base::program::check(argc, argv, [](const std::string& file) {
      const dial_gauge::Config config = configuration(file);
      return fmt::format("{} gauges, {} lines", config.gauges.size(), config.lines.size());
    });
  }
  // At most once: a repeated ZERO may set another zero point.
  sdk::ServiceProgram program({.uuid = "e6f15204-3a7c-4686-9bc3-1400d062127c",
                               .name = "dial_gauge",
                               .description = "Answers with the values of dial gauges",
                               .version = MILLRACE_VERSION,
                               .delivery = fabric::Delivery::at_most_once});
  std::string file;
  program.app().add_option(
      "--config", file,
      "Gauges to serve (dial_gauge.textproto). Without it, one simulated gauge "
      "G1 that shows 12.345 mm");
  base::program::add_check(program.app());
  std::optional<dial_gauge::RunningGauges> gauges;
  const std::function<sdk::Handler()> make = [&]() -> sdk::Handler {
    gauges.emplace(configuration(file), program.log(), program.alarms());
    return [&](const sdk::Call& call) { return gauges->answer(call.text()); };
  };
  return program.run(argc, argv, make);
}
