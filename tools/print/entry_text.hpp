// Entries of a recording, or of the live fabric, for people and programs.
#pragma once

#include <set>
#include <string>
#include <vector>

#include <boost/json/object.hpp>

#include "tools/recording/entry.hpp"

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

}  // namespace millrace::tools::print
