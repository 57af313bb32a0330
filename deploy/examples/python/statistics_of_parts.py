"""Mean, standard deviation and Cpk of the last parts, out of the archive.

    statistics_of_parts.py --archive /var/lib/millrace/archiver/archive

NC programs archive each part by `PUT part=WELLE7 d=12.345` (docs/reference/services/archiver.md, archiver). Request of this service:
"part=WELLE7 key=d low=12.30 high=12.40 last=50". Response: "n=50 mean=12.3451 s=0.0071 cpk=2.12", state 1; state 2: the
process is not capable, Cpk < 1.33; state 10: request not understood; state 11: too few parts.
"""

import math
import pathlib
import sqlite3
import statistics

import millrace

#: Below it a process is not capable (our choice, as most plants have it).
CAPABLE = 1.33
FEWEST = 5

archive = pathlib.Path("archive")

_LAST = """
SELECT value.value FROM put
JOIN field AS part ON part.put = put.id AND part.key = 'part' AND part.value = ?
JOIN field AS value ON value.put = put.id AND value.key = ?
WHERE put.replayed = 0 ORDER BY put.id DESC LIMIT ?
"""


def words_of(request):
    """"part=WELLE7 low=1" as a dict."""
    words = dict(word.split("=", 1) for word in request.split() if "=" in word)
    if "part" not in words or "low" not in words or "high" not in words:
        raise ValueError("expected part=NAME low=MM high=MM, and key=NAME last=N if needed")
    return words


def last_values(part, key, count):
    """The newest first, over as many files of the archive as needed."""
    values = []
    for file in sorted(archive.glob("archive-*.db"), reverse=True):
        connection = sqlite3.connect(f"file:{file}?mode=ro", uri=True, timeout=2)
        try:
            rows = connection.execute(_LAST, (part, key, count - len(values)))
            values += [float(value) for (value,) in rows]
        finally:
            connection.close()
        if len(values) >= count:
            break
    return values


@millrace.service("4b0d6a3e-6f0c-4b5e-9d57-4a1f0f6a1b02", name="statistics", version="1.0", concurrency=2)
def part_statistics(call):
    """Answers with mean, standard deviation and Cpk of the last parts."""
    try:
        words = words_of(call.text)
        low, high = float(words["low"]), float(words["high"])
        count = int(words.get("last", "50"))
        if not low < high or not FEWEST <= count <= 10_000:
            raise ValueError(f"expected low < high and last from {FEWEST} to 10000")
    except ValueError as error:
        return f"ERROR: {error}", 10
    values = last_values(words["part"], words.get("key", "d"), count)
    if len(values) < FEWEST:
        return f"ERROR: {len(values)} parts are archived, {FEWEST} are needed", 11
    mean, deviation = statistics.fmean(values), statistics.stdev(values)
    cpk = min(high - mean, mean - low) / (3 * deviation) if deviation > 0 else math.inf
    return f"n={len(values)} mean={mean:.4f} s={deviation:.4f} cpk={cpk:.2f}", 1 if cpk >= CAPABLE else 2


def main():
    global archive
    parser = millrace.argument_parser([part_statistics])
    parser.add_argument("--archive", type=pathlib.Path, required=True, help="Folder of millrace-archiver")
    arguments = parser.parse_args()
    archive = arguments.archive
    if not archive.is_dir():
        parser.error(f"--archive: {archive} is not a folder")
    millrace.run(arguments, part_statistics)


if __name__ == "__main__":
    main()
