#include "services/archiver/samples.hpp"

#include <cmath>

#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/text/cp1252.hpp"

namespace millrace::services::archiver {

namespace {

using fabric::DataSample;
using fabric::Quality;
using fabric::Value;

std::string json_of(std::int64_t element) {
  return std::to_string(element);
}
/// As 10 and not as 1E1. JSON has no number for infinity and NaN.
std::string json_of(double element) {
  const std::string text = fmt::format("{}", element);
  return std::isfinite(element) ? text : '"' + text + '"';
}
std::string json_of(const std::string& element) {
  return boost::json::serialize(boost::json::string(base::text::to_utf8(element)));
}

void bind_one(SQLite::Statement& statement, int index, std::int64_t element) {
  statement.bind(index, element);
}
void bind_one(SQLite::Statement& statement, int index, double element) {
  statement.bind(index, element);
}
void bind_one(SQLite::Statement& statement, int index, const std::string& element) {
  statement.bind(index, base::text::to_utf8(element));
}

/// A number or text unchanged, an array as JSON, NULL for no value.
void bind_value(SQLite::Statement& statement, int index, const Value& value) {
  std::visit(
      [&](const auto& elements) {
        if (value.is_array) {
          std::string all;
          for (const auto& element : elements) {
            all += (all.empty() ? "" : ",") + json_of(element);
          }
          statement.bind(index, "[" + all + "]");
        } else if (elements.empty()) {
          statement.bind(index);
        } else {
          bind_one(statement, index, elements.front());
        }
      },
      value.elements);
}

/// When the value was valid: a value without good quality has the time of its sample.
fabric::Time time_of(const DataSample& sample, const Value& value) {
  return value.quality == Quality::good && value.at != fabric::Time{} ? value.at : sample.at;
}

bool same(const Value& a, const Value& b) {
  return a.type == b.type && a.is_array == b.is_array && a.quality == b.quality &&
         a.reason == b.reason && a.elements == b.elements;
}

}  // namespace

std::string type_text(const Value& value) {
  return std::string(fabric::name_of(value.type)) + (value.is_array ? "[]" : "");
}

Samples::Samples(SQLite::Database& database)
    : find_(database,
            "SELECT id FROM variable WHERE machine = ? AND channel = ? AND grp = ? AND name = ? AND"
            " type = ?"),
      name_(database,
            "INSERT INTO variable (machine, channel, grp, name, type) VALUES (?, ?, ?, ?, ?)"),
      insert_(database,
              "INSERT INTO sample (at, variable, value, quality, reason, replayed)"
              " VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING"),
      database_(database) {}

void Samples::forget() {
  for (SQLite::Statement* const statement : {&find_, &name_, &insert_}) {
    statement->tryReset();
  }
  groups_.clear();
}

void Samples::add(const DataSample& sample) {
  const GroupKey key{sample.key.machine, sample.key.channel, sample.group};
  if (sample.values.empty()) {
    for (auto& [name, variable] : groups_[key]) {
      Value gone = variable.last;
      gone.quality = Quality::stale;
      gone.reason = base::messages::gateway_gone();
      write(sample, variable, gone);
    }
    return;
  }
  for (const Value& value : sample.values) {
    Variable& variable = variable_of(sample, value);
    if (!variable.written || !same(variable.last, value)) {
      write(sample, variable, value);
    }
  }
}

Samples::Variable& Samples::variable_of(const DataSample& sample, const Value& value) {
  const GroupKey key{sample.key.machine, sample.key.channel, sample.group};
  Variable& variable = groups_[key][value.name];
  const bool same_type =
      variable.last.type == value.type && variable.last.is_array == value.is_array;
  if (variable.id != 0 && same_type) {
    return variable;
  }
  const auto bind_all = [&](SQLite::Statement& statement) {
    statement.tryReset();
    statement.bind(1, sample.key.machine);
    statement.bind(2, std::int32_t{sample.key.channel});
    statement.bind(3, sample.group);
    statement.bind(4, value.name);
    statement.bind(5, type_text(value));
  };
  bind_all(find_);
  if (find_.executeStep()) {
    variable.id = find_.getColumn(0).getInt64();
  } else {
    bind_all(name_);
    name_.exec();
    variable.id = database_.getLastInsertRowid();
  }
  find_.reset();
  return variable;
}

void Samples::write(const DataSample& sample, Variable& variable, const Value& value) {
  insert_.tryReset();
  insert_.bind(1, time_of(sample, value).time_since_epoch().count());
  insert_.bind(2, variable.id);
  bind_value(insert_, 3, value);
  insert_.bind(4, std::string(fabric::name_of(value.quality)));
  value.reason.empty() ? insert_.bind(5) : insert_.bind(5, value.reason);
  insert_.bind(6, sample.replayed ? 1 : 0);
  insert_.exec();
  variable.last = value;
  variable.written = true;
}

}  // namespace millrace::services::archiver
