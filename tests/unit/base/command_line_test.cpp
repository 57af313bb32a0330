#include "base/program/command_line.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace millrace::base::program {
namespace {

int run_with(const char* value) {
  CLI::App app;
  std::optional<std::uint64_t> limit;
  CLI::App* const command = app.add_subcommand("list");
  command->add_option("--limit", limit);
  std::string text;
  command->add_option("--text", text);
  std::array<std::string, 6> words{"program", "list", "--limit", value, "--text", "-1"};
  std::array<char*, 6> argv{};
  for (std::size_t i = 0; i < words.size(); ++i) {
    argv.at(i) = words.at(i).data();
  }
  return run(app, static_cast<int>(argv.size()), argv.data(), [] { return exit_done; });
}

TEST(CommandLine, RefusesANegativeNumberForAnUnsignedFlag) {
  EXPECT_EQ(run_with("1"), exit_done);
  EXPECT_EQ(run_with("-1"), exit_usage);
  EXPECT_EQ(run_with("-18446744073709551615"), exit_usage);
}

}  // namespace
}  // namespace millrace::base::program
