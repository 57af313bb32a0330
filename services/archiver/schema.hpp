// The tables of an archive file, and the migration of older files.
//
//   archive  one row: begin and end of the file, and the id of its first put
//   put      data from NC programs: one row per call id
//   field    the key=value pairs of a put
//   event    events of calls, hop by hop
//   channel  states of channels; a repeated state is one row
//   variable sampled variables of machines: each variable of a group once
//   sample   values of variables: one row when the value or its quality changes; an array as JSON
//   program  events of NC programs
//
// Times are nanoseconds since 1970-01-01T00:00:00Z, texts UTF-8. call is "EPOCH-NUMBER" as in logs.
#pragma once

namespace SQLite {
class Database;
}

namespace millrace::services::archiver {

/// The version that this process writes (PRAGMA user_version).
inline constexpr int schema_version = 3;

/// Migrates a new or older file to schema_version, in one transaction. Throws std::runtime_error
/// for a file of a newer version, SQLite::Exception for one that is not a database.
void migrate(SQLite::Database& database);

}  // namespace millrace::services::archiver
