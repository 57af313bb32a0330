#include "tests/bench/gateway/rows.hpp"

#include <cstdio>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "tests/support/process.hpp"

namespace millrace::bench {

double Row::get(const std::string& name) const {
  const auto found = figures.find(name);
  return found == figures.end() ? 0 : found->second;
}

std::string Row::text(const std::string& name, int precision) const {
  return has(name) ? fmt::format("{:.{}f}", get(name), precision) : "-";
}

Row measure_row(std::vector<std::string> arguments, std::chrono::seconds limit) {
  arguments.insert(arguments.begin(), "/proc/self/exe");
  arguments.emplace_back("--row");
  tests::Process process(std::move(arguments));
  Row row;
  try {
    if (const int code = process.wait(limit); code != 0) {
      row.trouble = fmt::format("  the process of the gateway ended with {}\n", code);
    }
  } catch (const std::runtime_error&) {
    row.trouble = fmt::format("  not done after {} s\n", limit.count());
  }
  std::istringstream remarks(process.error_output());
  for (std::string line; std::getline(remarks, line);) {
    row.trouble += "  " + line + '\n';
  }
  std::istringstream output(process.output());
  std::string name;
  double value = 0;
  while (output >> name >> value) {
    row.figures[name] = value;
  }
  return row;
}

void tell_row(const Figures& figures) {
  for (const auto& [name, value] : figures) {
    fmt::print("{} {}\n", name, value);
  }
  std::fflush(stdout);
}

void remark(const std::string& what) {
  if (!what.empty()) {
    fmt::print(stderr, "{}\n", what.substr(0, what.find('\n')));
  }
}

}  // namespace millrace::bench
