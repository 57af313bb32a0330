#include <array>
#include <stdexcept>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "services/archiver/segment.hpp"

namespace millrace::services::archiver {

namespace {

/// Step n migrates version n to version n + 1. Released steps never change; new ones are appended.
constexpr std::array<const char*, schema_version> steps{
    // Puts. The call is a key, so that a repeated one adds no row.
    R"sql(
CREATE TABLE archive (
  begun     INTEGER NOT NULL,
  ended     INTEGER,
  first_put INTEGER NOT NULL
) STRICT;
CREATE TABLE put (
  id       INTEGER PRIMARY KEY,
  call     TEXT    NOT NULL UNIQUE,
  at       INTEGER NOT NULL,
  machine  TEXT    NOT NULL,
  channel  INTEGER NOT NULL,
  state    INTEGER NOT NULL,
  text     TEXT    NOT NULL,
  replayed INTEGER NOT NULL
) STRICT;
CREATE INDEX put_at ON put (at);
CREATE TABLE field (
  put   INTEGER NOT NULL REFERENCES put (id) ON DELETE CASCADE,
  key   TEXT    NOT NULL,
  value TEXT    NOT NULL,
  PRIMARY KEY (put, key)
) STRICT, WITHOUT ROWID;
)sql",
    // What the archiver itself observes on the fabric.
    R"sql(
CREATE TABLE event (
  id       INTEGER PRIMARY KEY,
  at       INTEGER NOT NULL,
  kind     TEXT    NOT NULL,
  machine  TEXT    NOT NULL,
  channel  INTEGER NOT NULL,
  call     TEXT    NOT NULL,
  attempt  INTEGER NOT NULL,
  instance TEXT    NOT NULL,
  uuid     TEXT    NOT NULL,
  text     TEXT,
  state    INTEGER NOT NULL,
  detail   TEXT    NOT NULL,
  replayed INTEGER NOT NULL
) STRICT;
CREATE INDEX event_at ON event (at);
CREATE INDEX event_call ON event (call);
CREATE TABLE channel (
  id       INTEGER PRIMARY KEY,
  at       INTEGER NOT NULL,
  machine  TEXT    NOT NULL,
  channel  INTEGER NOT NULL,
  state    TEXT    NOT NULL,
  call     TEXT    NOT NULL,
  attempt  INTEGER NOT NULL,
  instance TEXT    NOT NULL,
  uuid     TEXT    NOT NULL,
  reason   TEXT    NOT NULL,
  UNIQUE (machine, channel, at, state, call, attempt)
) STRICT;
CREATE INDEX channel_at ON channel (at);
)sql",
    // Machine data. A sample has no id: its time and variable are its place in the file, so that
    // rows of 25 bytes are appended at its end.
    R"sql(
CREATE TABLE variable (
  id      INTEGER PRIMARY KEY,
  machine TEXT    NOT NULL,
  channel INTEGER NOT NULL,
  grp     TEXT    NOT NULL,
  name    TEXT    NOT NULL,
  type    TEXT    NOT NULL,
  UNIQUE (machine, channel, grp, name, type)
) STRICT;
CREATE TABLE sample (
  at       INTEGER NOT NULL,
  variable INTEGER NOT NULL REFERENCES variable (id),
  value    ANY,
  quality  TEXT    NOT NULL,
  reason   TEXT,
  replayed INTEGER NOT NULL,
  PRIMARY KEY (at, variable)
) STRICT, WITHOUT ROWID;
CREATE TABLE program (
  id       INTEGER PRIMARY KEY,
  at       INTEGER NOT NULL,
  kind     TEXT    NOT NULL,
  machine  TEXT    NOT NULL,
  channel  INTEGER NOT NULL,
  program  TEXT    NOT NULL,
  started  INTEGER,
  error    INTEGER NOT NULL,
  parts    INTEGER,
  mode     INTEGER NOT NULL,
  detail   TEXT    NOT NULL,
  replayed INTEGER NOT NULL,
  UNIQUE (machine, channel, at, kind)
) STRICT;
CREATE INDEX program_at ON program (at);
)sql",
};

}  // namespace

void refuse_newer(SQLite::Database& database) {
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (version > schema_version) {
    throw std::runtime_error(
        fmt::format("{}: written by a newer millrace (schema {}, this one knows up to {})",
                    database.getFilename(), version, schema_version));
  }
}

void migrate(SQLite::Database& database) {
  refuse_newer(database);
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (version == schema_version) {
    return;
  }
  SQLite::Transaction transaction(database);
  for (auto step = static_cast<std::size_t>(version); step < steps.size(); ++step) {
    database.exec(steps.at(step));
  }
  database.exec(fmt::format("PRAGMA user_version = {}", schema_version));
  transaction.commit();
}

}  // namespace millrace::services::archiver
