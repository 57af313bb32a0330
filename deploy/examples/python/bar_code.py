"""Looks a bar code up in an SQLite database and answers with what the part needs.

    bar_code.py --database parts.db

    CREATE TABLE part (code TEXT PRIMARY KEY, program TEXT NOT NULL, offset_mm REAL NOT NULL) STRICT;

Request: the bar code. Response: "PROGRAM OFFSET", state 1; state 10: no such part; state 500: the database cannot be
read.
"""

import sqlite3
import sys

import millrace

database = "parts.db"


@millrace.service("4b0d6a3e-6f0c-4b5e-9d57-4a1f0f6a1b01", name="bar_code", version="1.0", concurrency=4)
def bar_code(call):
    """Answers a bar code with NC program and offset of its part."""
    # A connection of its own for each call: threads do not share one, and to open a file is cheap.
    connection = sqlite3.connect(f"file:{database}?mode=ro", uri=True, timeout=2)
    try:
        row = connection.execute("SELECT program, offset_mm FROM part WHERE code = ?", (call.text.strip(),)).fetchone()
    finally:
        connection.close()
    if row is None:
        return f"ERROR: no part has the code {call.text.strip()[:60]!r}", 10
    program, offset = row
    return f"{program} {offset:.4f}"


def main():
    global database
    parser = millrace.argument_parser([bar_code])
    parser.add_argument("--database", required=True, help="SQLite file with the table 'part'")
    arguments = parser.parse_args()
    database = arguments.database
    try:
        sqlite3.connect(f"file:{database}?mode=ro", uri=True).execute("SELECT count(*) FROM part").fetchone()
    except sqlite3.Error as error:
        sys.exit(f"bar_code: {database}: {error}; expected a database with the table 'part'")
    millrace.run(arguments, bar_code)


if __name__ == "__main__":
    main()
