// The table of a spool's database, and a row of it as an Entry.
//
// Times are nanoseconds since 1970-01-01T00:00:00Z, 0 if there is none. call is "EPOCH-NUMBER" as
// in logs, recipients are one per line; the mail is empty once the server has taken it.
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

/// What this program writes (PRAGMA user_version).
inline constexpr int spool_schema_version = 1;

/// Makes a database that was opened ready for durable writing, with the table of today. Throws
/// std::runtime_error with file and what to do for one that is damaged, somebody else's or of a
/// newer version, SQLite::Exception otherwise.
void prepare(SQLite::Database& database);

/// What is said of a database that is damaged or no spool.
std::string damage(const std::string& file, std::string_view why);

/// "waiting", "handed over", "accepted", "refused", "given up"
std::string_view name_of(Stage stage);

fabric::Time time_of(std::int64_t nanoseconds);

/// "5f-17" as a call; throws std::runtime_error for anything else.
fabric::CallId call_in(const std::string& text);

/// Binds call, stage, made, next, attempts, reply, sender, recipients and message, in this order.
void bind(SQLite::Statement& statement, const Entry& entry);
/// Of the same columns; throws std::runtime_error if they do not hold an entry.
Entry entry_in(SQLite::Statement& row);

}  // namespace millrace::services::mail
