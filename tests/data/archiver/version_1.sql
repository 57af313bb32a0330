-- An archive file as schema version 1 left it, with one put.
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
PRAGMA user_version = 1;
INSERT INTO archive (begun, first_put) VALUES (1772348400000000000, 1);
INSERT INTO put VALUES (1, '5f-17', 1772348400000000000, 'cnc', 1, 7, 'PUT part=WELLE7', 0);
INSERT INTO field VALUES (1, 'part', 'WELLE7');
