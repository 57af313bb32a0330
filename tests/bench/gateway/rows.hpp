// A row of a table, measured in its own process: it leaves nothing that disturbs the next one, and
// a row that crashes or hangs loses only itself.
//
//   child:  tell_row({{"calls_per_second", 41'000}});
//   parent: const Row row = measure_row({"scaling", "--instances", "64"}, limit);
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace millrace::bench {

/// What was measured, by name; without what could not be measured.
using Figures = std::map<std::string, double>;

struct Row {
  Figures figures;
  /// Why figures are missing, or a remark about them; whole lines.
  std::string trouble;

  [[nodiscard]] bool has(const std::string& name) const { return figures.contains(name); }
  /// 0 without such a figure.
  [[nodiscard]] double get(const std::string& name) const;
  /// With `precision` digits after the point; "-" without such a figure.
  [[nodiscard]] std::string text(const std::string& name, int precision = 0) const;
};

/// Runs this program with `--row` and the arguments, until it ends or `limit` is over.
Row measure_row(std::vector<std::string> arguments, std::chrono::seconds limit);

/// Sends figures to the parent process; later ones are added.
void tell_row(const Figures& figures);
/// Sends a remark about them to the parent process: the first line of `what`, if it is not empty.
void remark(const std::string& what);

}  // namespace millrace::bench
