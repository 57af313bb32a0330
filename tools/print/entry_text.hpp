// Entries of a recording, or of the live fabric, for people and programs.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/object.hpp>

#include "tools/recording/entry.hpp"
#include "tools/recording/timeline.hpp"

namespace millrace::tools::print {

/// One line without newline: time, kind, channel, call, and the contents of the kind.
std::string line_of(const recording::Entry& entry);

/// Every field by name. Texts are UTF-8, ids in their text form, times ISO 8601 in UTC; times and
/// ids that are not known are left out.
boost::json::object json_of(const recording::Entry& entry);

/// Entries as comma-separated values: one row each, UTF-8, quoted as RFC 4180 has it. The columns
/// are the names of all JSON fields that entries of these kinds may have; none = of every kind.
class Csv {
 public:
  explicit Csv(const std::set<std::string>& kinds = {});

  /// The names of the columns, with line end.
  [[nodiscard]] std::string header() const;
  [[nodiscard]] std::string row(const recording::Entry& entry) const;

 private:
  std::vector<std::string> columns_;
};

/// Of a call that has ended.
/// "07:00:00.123456Z  cnc/1  560aacbf-…  "2" 1 -> "1.414214" 1  2.40 ms  sq1 on vm  5f-17"
std::string line_of(const recording::Call& call, const recording::InstanceNames::Name& instance);
boost::json::object json_of(const recording::Call& call,
                            const recording::InstanceNames::Name& instance);
/// "written" or "withdrawn"; empty while it is under way.
std::string_view end_of(const recording::Call& call);

/// A line for each step, for a terminal.
std::string text_of(const recording::Timeline& timeline);
/// As `recording calls --json FILE CALL` prints it.
boost::json::object json_of(const recording::Timeline& timeline);

}  // namespace millrace::tools::print
