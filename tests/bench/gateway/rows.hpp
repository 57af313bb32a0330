// A row of a table, measured in a process of its own: what one row leaves behind does not disturb
// the next, and a row that crashes or hangs costs itself only.
//
//   child:  tell_row({{"calls_per_second", 41'000}});
//   parent: const Row row = measure_row({"scaling", "--instances", "64"}, limit);
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace millrace::bench {

/// What was measured, by name. What could not be measured is not there.
using Figures = std::map<std::string, double>;

struct Row {
  Figures figures;
  /// Why there are none, or not all of them, or what must be known about them; whole lines.
  std::string trouble;

  [[nodiscard]] bool has(const std::string& name) const { return figures.contains(name); }
  /// 0 if it is not there.
  [[nodiscard]] double get(const std::string& name) const;
  /// With `precision` digits after the point; "-" if it is not there.
  [[nodiscard]] std::string text(const std::string& name, int precision = 0) const;
};

/// Runs this program with `--row` and the arguments, until it ends or `limit` is over.
Row measure_row(std::vector<std::string> arguments, std::chrono::seconds limit);

/// Tells the starter figures; those told later are added.
void tell_row(const Figures& figures);
/// Tells the starter what must be known about them: the first line of `what`, if it is not empty.
void remark(const std::string& what);

}  // namespace millrace::bench
