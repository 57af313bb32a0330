// How values of machines are stored: a file has each variable of a group once, and a row is written
// when its value or quality changes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include <SQLiteCpp/SQLiteCpp.h>

#include "fabric/data.hpp"

namespace millrace::services::archiver {

class Samples {
 public:
  /// The tables must exist. The database must outlive this.
  explicit Samples(SQLite::Database& database);

  /// Adds rows for what has changed in a sample. A sample without values ends the good values of
  /// its group.
  void add(const fabric::DataSample& sample);
  /// Call it after a transaction was rolled back.
  void forget();

 private:
  /// Machine, channel, group.
  using GroupKey = std::tuple<std::string, std::uint16_t, std::string>;

  struct Variable {
    std::int64_t id = 0;
    /// The last written value; its time is not compared.
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

/// The text of a type in its column: "REAL64", "SGN16[]" for an array.
std::string type_text(const fabric::Value& value);

}  // namespace millrace::services::archiver
