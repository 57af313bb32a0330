#include "services/mail/spool_schema.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "fabric/messages.hpp"

namespace millrace::services::mail {

namespace {

constexpr const char* table = R"sql(
CREATE TABLE mail (
  call       TEXT    NOT NULL PRIMARY KEY,
  stage      TEXT    NOT NULL
             CHECK (stage IN ('waiting', 'handed over', 'accepted', 'refused', 'given up')),
  made       INTEGER NOT NULL,
  next       INTEGER NOT NULL,
  attempts   INTEGER NOT NULL,
  reply      TEXT    NOT NULL,
  sender     TEXT    NOT NULL,
  recipients TEXT    NOT NULL,
  message    TEXT    NOT NULL
) STRICT;
CREATE INDEX mail_stage ON mail (stage, made);
)sql";

constexpr std::array stages{Stage::waiting, Stage::handed_over, Stage::accepted, Stage::refused,
                            Stage::given_up};

std::int64_t count(fabric::Time time) {
  return time.time_since_epoch().count();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

}  // namespace

std::string damage(const std::string& file, std::string_view why) {
  return fmt::format(
      "{}: damaged, or not the spool of a mail service: {}. It records which calls were sent: "
      "repair it (sqlite3 has .recover), or move it away; then earlier calls may be sent again",
      file, why);
}

void prepare(SQLite::Database& database) {
  const std::string& file = database.getFilename();
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (version > spool_schema_version) {
    throw std::runtime_error(
        fmt::format("{}: written by a newer millrace (schema {}, this one knows up to {})", file,
                    version, spool_schema_version));
  }
  if (version == 0 &&
      database.execAndGet("SELECT EXISTS (SELECT 1 FROM sqlite_master)").getInt() != 0) {
    throw std::runtime_error(damage(file, "it is the database of another program"));
  }
  if (const std::string state = database.execAndGet("PRAGMA quick_check(1)").getString();
      state != "ok") {
    throw std::runtime_error(damage(file, state));
  }
  database.exec("PRAGMA journal_mode = WAL");
  // Each commit is on the disk when it returns, so that a power cut does not send a mail twice.
  database.exec("PRAGMA synchronous = FULL");
  if (version == 0) {
    SQLite::Transaction transaction(database);
    database.exec(table);
    database.exec(fmt::format("PRAGMA user_version = {}", spool_schema_version));
    transaction.commit();
  }
}

std::string_view name_of(Stage stage) {
  switch (stage) {
    case Stage::waiting:
      return "waiting";
    case Stage::handed_over:
      return "handed over";
    case Stage::accepted:
      return "accepted";
    case Stage::refused:
      return "refused";
    case Stage::given_up:
      return "given up";
  }
  return "";
}

fabric::Time time_of(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

fabric::CallId call_in(const std::string& text) {
  const auto call = fabric::parse_call_id(text);
  if (!call) {
    throw std::runtime_error(fmt::format("'{}' is not a call", text));
  }
  return *call;
}

void bind(SQLite::Statement& statement, const Entry& entry) {
  int index = 0;
  statement.bind(++index, entry.call.to_string());
  statement.bind(++index, std::string(name_of(entry.stage)));
  statement.bind(++index, count(entry.made));
  statement.bind(++index, count(entry.next));
  statement.bind(++index, entry.attempts);
  statement.bind(++index, entry.reply);
  statement.bind(++index, entry.mail.from);
  // Addresses have no line ends (message.cpp).
  statement.bind(++index, fmt::format("{}", fmt::join(entry.mail.to, "\n")));
  statement.bind(++index, entry.mail.message);
}

Entry entry_in(SQLite::Statement& row) {
  int index = 0;
  Entry entry{.call = call_in(row.getColumn(index).getString())};
  const std::string stage = row.getColumn(++index).getString();
  const auto* known = std::find_if(stages.begin(), stages.end(),
                                   [&](Stage each) { return name_of(each) == stage; });
  if (known == stages.end()) {
    throw std::runtime_error(
        fmt::format("call {} has the stage '{}'", entry.call.to_string(), stage));
  }
  entry.stage = *known;
  entry.made = time_of(row.getColumn(++index).getInt64());
  entry.next = time_of(row.getColumn(++index).getInt64());
  entry.attempts = row.getColumn(++index).getUInt();
  entry.reply = row.getColumn(++index).getString();
  entry.mail.from = row.getColumn(++index).getString();
  entry.mail.to = lines_of(row.getColumn(++index).getString());
  entry.mail.message = row.getColumn(++index).getString();
  return entry;
}

}  // namespace millrace::services::mail
