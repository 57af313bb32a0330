"""Recordings, as the C++ reader sees them."""

import csv
import json
import logging
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import millrace
from support import BIN, TOP

FILE = TOP / "tests/data/recordings/demo.mcap"


class ARecording(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_has_the_calls_that_the_command_lists(self):
        listed = json.loads(subprocess.run([BIN / "millrace", "recording", "calls", "--json", FILE], check=True,
                                           capture_output=True, env={**os.environ, "MILLRACE_FABRIC_CONFIG": ""}).stdout)
        calls = {call.call_id: call for call in millrace.Recording(FILE)}
        self.assertEqual(len(calls), len(listed))
        for one in listed:
            call = calls[one["call"]]
            for name in ("machine", "channel", "uuid", "attempt", "name", "host", "request", "request_state", "response",
                         "response_state", "detail"):
                self.assertEqual(getattr(call, name), one[name], name)
            self.assertAlmostEqual(call.hops["total"] * 1000, one["duration_ms"], places=3)
            self.assertAlmostEqual(call.ended - call.seen, call.hops["total"], places=5)

    def test_shows_the_hops_and_steps_of_a_call(self):
        call = millrace.Recording(FILE).to_list()[-1]
        self.assertEqual((call.request, call.response_state, call.outcome), ("-1", 99, "answered"))
        parts = [call.hops[hop] for hop in ("dispatch", "to_service", "queue", "work", "to_gateway", "write_back")]
        self.assertAlmostEqual(sum(parts), call.hops["total"], places=6)
        names = [step.name for step in call.steps]
        self.assertEqual((names[0], names[-1]), ("seen by the gateway", "written back"))
        self.assertIn("handler started", names)
        (answered,) = (step for step in call.steps if step.name == "answered by the instance")
        self.assertTrue(answered.by_service)
        self.assertEqual((answered.text, answered.instance), (call.response, call.instance))

    def test_may_be_iterated_again_and_left_early(self):
        sut = millrace.Recording(FILE)
        for _ in sut:
            break
        self.assertEqual(len(sut.to_list()), len(sut.to_list()))
        self.assertEqual(sut.problems, [])

    def test_becomes_a_csv_file(self):
        millrace.Recording(FILE).to_csv(self.folder / "calls.csv")
        with open(self.folder / "calls.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 6)
        self.assertEqual((rows[-1]["request"], rows[-1]["response_state"], rows[-1]["replayed"]), ("-1", "99", "False"))
        self.assertGreater(float(rows[-1]["work"]), 0)
        self.assertNotIn("steps", rows[-1])

    def test_becomes_a_frame_where_pandas_is_installed(self):
        if "pandas" not in sys.modules:
            stand_in = types.ModuleType("pandas")
            stand_in.DataFrame = lambda rows: {key: [row[key] for row in rows] for key in rows[0]}
            stand_in.to_datetime = lambda column, unit, utc: [f"{time:.0f} {unit} {utc}" for time in column]
            sys.modules["pandas"] = stand_in
            self.addCleanup(sys.modules.pop, "pandas")
        frame = millrace.Recording(FILE).to_frame()
        self.assertEqual(list(frame["request"])[-1], "-1")
        self.assertEqual(len(frame["seen"]), 6)
        self.assertGreater(list(frame["total"])[-1], 0)

    def test_needs_pandas_only_for_a_frame(self):
        sys.modules["pandas"] = None
        self.addCleanup(sys.modules.pop, "pandas")
        with self.assertRaises(ImportError):
            millrace.Recording(FILE).to_frame()

    def test_names_damaged_places_and_reads_the_rest(self):
        data = FILE.read_bytes()
        (self.folder / "cut.mcap").write_bytes(data[: len(data) // 2])
        sut = millrace.Recording(self.folder / "cut.mcap")
        with self.assertLogs("millrace", logging.WARNING) as logged:
            sut.to_list()
        self.assertRegex(sut.problems[0], r"^at byte \d+: ")
        self.assertIn("cut.mcap: at byte", logged.output[0])

    def test_that_is_missing_is_an_error_at_once(self):
        with self.assertRaises(FileNotFoundError):
            millrace.Recording(self.folder / "gone.mcap")


if __name__ == "__main__":
    unittest.main()
