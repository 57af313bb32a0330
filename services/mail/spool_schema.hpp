// The table of a spool's database, and the conversion of its rows to Entry.
//
// Times are nanoseconds since 1970-01-01T00:00:00Z, 0 = none. call is "EPOCH-NUMBER" as in logs,
// recipients are one per line; the mail is empty once the server has accepted it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "services/mail/mail.hpp"

namespace SQLite {
class Database;
class Statement;
}  // namespace SQLite

namespace millrace::services::mail {

/// The version that this process writes (PRAGMA user_version).
inline constexpr int spool_schema_version = 1;

/// Prepares an opened database for durable writing, with the current table. Throws
/// std::runtime_error with file and advice for one that is damaged, not a spool or of a newer
/// version, SQLite::Exception otherwise.
void prepare(SQLite::Database& database);

/// The error text for a database that is damaged or not a spool.
std::string damage(const std::string& file, std::string_view why);

/// "waiting", "handed over", "accepted", "refused", "given up"
std::string_view name_of(Stage stage);

fabric::Time time_of(std::int64_t nanoseconds);

/// Parses a call such as "5f-17"; throws std::runtime_error for any other text.
fabric::CallId call_in(const std::string& text);

/// Binds call, stage, made, next, attempts, reply, sender, recipients and message, in this order.
void bind(SQLite::Statement& statement, const Entry& entry);
/// Reads the same columns; throws std::runtime_error if they are not a valid entry.
Entry entry_in(SQLite::Statement& row);

}  // namespace millrace::services::mail
