// The tables of an archive file, and how older files get them.
//
// archive  one row: when the file was begun and ended, and the id its first put has
// put      what programs gave: one row per call id
// field    the key=value pairs of a put
// event    what happened to calls, hop by hop
// channel  states of channels; the same state told twice is one row
// variable what of machines is sampled: each variable of a group once
// sample   values of variables: one row when a value is another one, or its quality; an array as
// JSON program  what became of programs
//
// Times are nanoseconds since 1970-01-01T00:00:00Z, texts UTF-8. call is "EPOCH-NUMBER" as in logs.
#pragma once

namespace SQLite {
class Database;
}

namespace millrace::services::archiver {

/// What this program writes (PRAGMA user_version).
inline constexpr int schema_version = 3;

/// Brings a new or older file to schema_version, in one transaction. Throws std::runtime_error for
/// a file of a newer version, SQLite::Exception for one that is no database.
void migrate(SQLite::Database& database);

}  // namespace millrace::services::archiver
