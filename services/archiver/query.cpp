#include "services/archiver/query.hpp"

#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "services/archiver/archive.hpp"

namespace millrace::services::archiver {

namespace {

struct Column {
  const char* name;
  /// SQL over the table, whose rows are called `row`.
  const char* expression;
  bool json = false;
};
using Columns = std::vector<Column>;

struct Source {
  /// The table that must exist.
  const char* table;
  /// The FROM clause, if it is not the table itself.
  const char* from;
  const char* order;
  Columns columns;
};

constexpr const char* samples =
    "(SELECT sample.*, machine, channel, grp, name, type FROM sample JOIN variable ON variable.id ="
    " sample.variable)";

Source source_of(Kind kind) {
  // People read microseconds; the file has nanoseconds.
  const Column at{"at",
                  "strftime('%Y-%m-%dT%H:%M:%S', row.at / 1000000000, 'unixepoch')"
                  " || printf('.%06dZ', row.at / 1000 % 1000000)"};
  Columns columns{{"id", "row.id"},
                  at,
                  {"machine", "row.machine"},
                  {"channel", "row.channel"},
                  {"call", "row.call"}};
  const auto with = [&](const char* table, const Columns& more) {
    columns.insert(columns.end(), more.begin(), more.end());
    return Source{table, table, "row.id", columns};
  };
  switch (kind) {
    case Kind::put:
      return with(
          "put",
          {{"state", "row.state"},
           {"text", "row.text"},
           {"fields", "(SELECT json_group_object(key, value) FROM field WHERE put = row.id)", true},
           {"replayed", "row.replayed"}});
    case Kind::event:
      return with("event", {{"attempt", "row.attempt"},
                            {"kind", "row.kind"},
                            {"instance", "row.instance"},
                            {"uuid", "row.uuid"},
                            {"state", "row.state"},
                            {"text", "row.text"},
                            {"detail", "row.detail"},
                            {"replayed", "row.replayed"}});
    case Kind::channel:
      return with("channel", {{"attempt", "row.attempt"},
                              {"state", "row.state"},
                              {"instance", "row.instance"},
                              {"uuid", "row.uuid"},
                              {"reason", "row.reason"}});
    case Kind::sample:
      return {"sample",
              samples,
              "row.at",
              {at,
               {"machine", "row.machine"},
               {"channel", "row.channel"},
               {"group", "row.grp"},
               {"variable", "row.name"},
               {"type", "row.type"},
               {"value", "row.value"},
               {"quality", "row.quality"},
               {"reason", "row.reason"},
               {"replayed", "row.replayed"}}};
    case Kind::program:
      return {"program",
              "program",
              "row.id",
              {{"id", "row.id"},
               at,
               {"machine", "row.machine"},
               {"channel", "row.channel"},
               {"kind", "row.kind"},
               {"program", "row.program"},
               {"seconds", "(row.at - row.started) / 1e9"},
               {"error", "row.error"},
               {"parts", "row.parts"},
               {"mode", "row.mode"},
               {"detail", "row.detail"},
               {"replayed", "row.replayed"}}};
  }
  throw std::logic_error("no such kind of row");
}

/// The conditions of a filter and, in the same order, the values bound to them.
class Condition {
 public:
  explicit Condition(const Filter& filter) {
    add("row.at >= ?", filter.since.value_or(fabric::Time::min()).time_since_epoch().count());
    add("row.at < ?", filter.until.value_or(fabric::Time::max()).time_since_epoch().count());
    if (filter.machine) {
      add("row.machine = ?", *filter.machine);
    }
    if (filter.channel) {
      add("row.channel = ?", std::int32_t{*filter.channel});
    }
    if (filter.call) {
      add("row.call = ?", *filter.call);
    }
    if (filter.group) {
      add("row.grp = ?", *filter.group);
    }
    if (filter.variable) {
      add("row.name = ?", *filter.variable);
    }
    if (filter.key) {
      add("EXISTS (SELECT 1 FROM field WHERE put = row.id AND key = ? AND value = coalesce(?, "
          "value))",
          *filter.key);
      bind_later(filter.value);
    }
  }

  [[nodiscard]] const std::string& sql() const { return sql_; }

  void bind(SQLite::Statement& statement) const {
    int index = 0;
    for (const auto& value : values_) {
      value(statement, ++index);
    }
  }

 private:
  template <typename Value>
  void add(const char* text, const Value& value) {
    sql_ += (sql_.empty() ? "" : " AND ") + std::string(text);
    values_.emplace_back(
        [value](SQLite::Statement& statement, int index) { statement.bind(index, value); });
  }
  /// Nullopt becomes NULL.
  void bind_later(const std::optional<std::string>& value) {
    values_.emplace_back([value](SQLite::Statement& statement, int index) {
      value ? statement.bind(index, *value) : statement.bind(index);
    });
  }

  std::string sql_;
  std::vector<std::function<void(SQLite::Statement&, int)>> values_;
};

std::string sql_of(const Source& source, const Condition& condition) {
  std::string columns;
  for (const Column& column : source.columns) {
    columns += (columns.empty() ? "" : ", ") + std::string(column.expression);
  }
  return fmt::format("SELECT {} FROM {} AS row WHERE {} ORDER BY {}", columns, source.from,
                     condition.sql(), source.order);
}

Cell cell_of(const SQLite::Column& value, const Column& column) {
  if (value.isNull()) {
    return {};
  }
  if (value.isFloat()) {
    // The shortest form of the same number; JSON has none for infinity.
    const double number = value.getDouble();
    return {.type = std::isfinite(number) ? Cell::Type::number : Cell::Type::text,
            .text = fmt::format("{}", number)};
  }
  const Cell::Type text = column.json ? Cell::Type::json : Cell::Type::text;
  return {.type = value.isInteger() ? Cell::Type::number : text, .text = value.getString()};
}

/// Writes and counts the rows of one file until there are `limit` in total. `rows` is called only
/// once the file proves to be readable.
template <typename Rows>
void write_file(const std::filesystem::path& file, const Source& source, const Condition& condition,
                std::uint64_t limit, const Rows& rows, std::uint64_t& count) {
  SQLite::Database database = open_to_read(file);
  if (!database.tableExists("archive")) {
    throw std::runtime_error("not a file of an archive");
  }
  RowWriter& writer = rows();
  if (!database.tableExists(source.table)) {
    return;  // an older file that never had this table
  }
  SQLite::Statement select(database, sql_of(source, condition));
  condition.bind(select);
  std::vector<Cell> cells(source.columns.size());
  while (count < limit && select.executeStep()) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      cells[i] = cell_of(select.getColumn(static_cast<int>(i)), source.columns[i]);
    }
    writer.write(cells);
    ++count;
  }
}

}  // namespace

Found write_rows(const std::filesystem::path& folder, const Filter& filter, Format format,
                 std::ostream& out) {
  const Source source = source_of(filter.kind);
  const Condition condition(filter);
  std::vector<std::string> names;
  for (const Column& column : source.columns) {
    names.emplace_back(column.name);
  }
  std::optional<RowWriter> writer;
  const auto rows = [&]() -> RowWriter& {
    return writer ? *writer : writer.emplace(format, names, out);
  };
  const std::uint64_t limit = filter.limit.value_or(UINT64_MAX);
  Found found;
  for (const auto& file : archive_files(folder)) {
    try {
      write_file(file, source, condition, limit, rows, found.rows);
    } catch (const std::exception& why) {
      // An expired file may just have been removed.
      if (std::filesystem::exists(file)) {
        found.unread.push_back(fmt::format("{}: {}", file.string(), why.what()));
      }
    }
  }
  if (found.unread.empty()) {
    rows();  // An archive without a file has no rows, which is a valid result.
  }
  found.read = writer.has_value();
  return found;
}

}  // namespace millrace::services::archiver
