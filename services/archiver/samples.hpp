// How values of machines are kept: each variable of a group is named once in a file, and a row is
// written when its value is another one, or its quality.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <SQLiteCpp/SQLiteCpp.h>

#include "fabric/data.hpp"

namespace millrace::services::archiver {

class Samples {
 public:
  /// The tables are there. The database outlives this.
  explicit Samples(SQLite::Database& database);

  /// Rows of what is new in a sample. One without values ends what was good in its group.
  void add(const fabric::DataSample& sample);
  /// After a transaction that was taken back.
  void forget();

 private:
  /// Machine, channel, group.
  using GroupKey = std::tuple<std::string, std::uint16_t, std::string>;

  struct Variable {
    std::int64_t id = 0;
    /// What was written last; its time does not count.
    fabric::Value last{};
    bool written = false;
  };

  Variable& variable_of(const fabric::DataSample& sample, const fabric::Value& value);
  void write(const fabric::DataSample& sample, Variable& variable, const fabric::Value& value);

  SQLite::Statement find_;
  SQLite::Statement name_;
  SQLite::Statement insert_;
  SQLite::Database& database_;
  /// By the name of the variable.
  std::map<GroupKey, std::map<std::string, Variable>> groups_;
};

/// A type as its column has it: "REAL64", "SGN16[]" of an array.
std::string type_text(const fabric::Value& value);

}  // namespace millrace::services::archiver
