"""The examples of deploy/examples/python, with the test bench for users."""

import http.server
import pathlib
import re
import socket
import socketserver
import sqlite3
import sys
import tempfile
import threading
import unittest

from millrace import testing

TOP = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(TOP / "deploy/examples/python"))

import bar_code  # noqa: E402
import mes_order  # noqa: E402
import statistics_of_parts  # noqa: E402


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, script):
        connection = sqlite3.connect(self.folder / name)
        connection.executescript(script)
        connection.close()


class BarCode(InAFolder):
    def setUp(self):
        super().setUp()
        self.write("parts.db", """
            CREATE TABLE part (code TEXT PRIMARY KEY, program TEXT NOT NULL, offset_mm REAL NOT NULL) STRICT;
            INSERT INTO part VALUES ('4006381333931', 'WELLE7', 0.25);""")
        bar_code.database = str(self.folder / "parts.db")

    def test_answers_with_program_and_offset(self):
        response = testing.call(bar_code.bar_code, " 4006381333931 ")
        self.assertEqual((response.text, response.state), ("WELLE7 0.2500", 1))

    def test_reports_an_unknown_code(self):
        response = testing.call(bar_code.bar_code, "x' OR 1=1 --")
        self.assertEqual((response.text, response.state), ('ERROR: no part has the code "x\' OR 1=1 --"', 10))

    def test_reports_that_the_database_cannot_be_read(self):
        bar_code.database = str(self.folder / "gone.db")
        response = testing.call(bar_code.bar_code, "1")
        self.assertEqual((response.text, response.state), ("ERROR: unable to open database file", 500))


class StatisticsOfParts(InAFolder):
    # As services/archiver/schema.cpp creates them.
    TABLES = """
        CREATE TABLE put (id INTEGER PRIMARY KEY, call TEXT NOT NULL UNIQUE, at INTEGER NOT NULL, machine TEXT NOT NULL,
          channel INTEGER NOT NULL, state INTEGER NOT NULL, text TEXT NOT NULL, replayed INTEGER NOT NULL) STRICT;
        CREATE TABLE field (put INTEGER NOT NULL REFERENCES put (id) ON DELETE CASCADE, key TEXT NOT NULL,
          value TEXT NOT NULL, PRIMARY KEY (put, key)) STRICT, WITHOUT ROWID;"""

    def setUp(self):
        super().setUp()
        statistics_of_parts.archive = self.folder
        self.number = 0

    def archive(self, name, values, part="WELLE7", replayed=0):
        rows = []
        for value in values:
            self.number += 1
            rows.append(f"INSERT INTO put VALUES ({self.number}, '1-{self.number}', 0, 'cnc', 1, 1, '', {replayed});"
                        f"INSERT INTO field VALUES ({self.number}, 'part', '{part}'), ({self.number}, 'd', '{value}');")
        tables = "" if (self.folder / name).exists() else self.TABLES
        self.write(name, tables + "".join(rows))

    def ask(self, request):
        response = testing.call(statistics_of_parts.part_statistics, request)
        return response.text, response.state

    def test_answers_with_the_figures_of_the_last_parts_of_all_files(self):
        self.archive("archive-000001.db", [99, 12.34, 12.36])
        self.archive("archive-000002.db", [12.35, 12.34, 12.36])
        self.archive("archive-000002.db", [5], part="BOLZEN")
        self.archive("archive-000002.db", [5], replayed=1)
        self.assertEqual(self.ask("part=WELLE7 low=12.30 high=12.40 last=5"), ("n=5 mean=12.3500 s=0.0100 cpk=1.67", 1))
        self.assertEqual(self.ask("part=WELLE7 low=12.32 high=12.40 last=5"), ("n=5 mean=12.3500 s=0.0100 cpk=1.00", 2))

    def test_reports_wrong_requests_and_missing_parts(self):
        self.archive("archive-000001.db", [1, 2])
        self.assertEqual(self.ask("part=WELLE7 low=0 high=3"), ("ERROR: 2 parts are archived, 5 are needed", 11))
        for request in ("", "part=x low=a high=2", "part=x low=2 high=1", "part=x low=1 high=2 last=0"):
            self.assertEqual(self.ask(request)[1], 10, request)


class MesOrder(unittest.TestCase):
    def setUp(self):
        test = self
        self.answers = []
        self.asked = []

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                test.asked.append((self.path, self.headers["Idempotency-Key"]))
                code, text = test.answers.pop(0)
                self.send_response(code)
                self.end_headers()
                self.wfile.write(text.encode())

            def log_message(self, *_):
                pass

        # An HTTPServer would resolve the name of its host.
        self.server = socketserver.TCPServer(("127.0.0.1", 0), Handler)
        self.addCleanup(self.server.server_close)
        thread = threading.Thread(target=self.server.serve_forever, args=(0.01,))
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(self.server.shutdown)
        mes_order.url = f"http://127.0.0.1:{self.server.server_address[1]}/orders"
        self.addCleanup(setattr, mes_order, "PAUSE", mes_order.PAUSE)
        self.addCleanup(setattr, mes_order, "TOGETHER", mes_order.TOGETHER)
        mes_order.PAUSE = 0.001

    def test_requests_the_order_of_the_machine_of_the_call(self):
        self.answers = [(200, "order 4711 für Köln\n")]
        self.assertEqual(testing.call(mes_order.mes_order, machine="press", channel=2, id="5f3a-1").text, "order 4711 für Köln")
        self.assertEqual(self.asked, [("/orders?machine=press&channel=2", "5f3a-1")])

    def test_retries_with_interim_responses_to_the_program(self):
        self.answers = [(503, ""), (500, ""), (200, "order 1")]
        call = testing.FakeCall()
        self.assertEqual(mes_order.mes_order(call), "order 1")
        self.assertEqual([one.state for one in call.interims], [50, 50])
        self.assertEqual(len({key for _, key in self.asked}), 1, "the same call")

    def test_does_not_retry_what_the_mes_refuses(self):
        self.answers = [(404, "")]
        response = testing.call(mes_order.mes_order)
        self.assertEqual((response.text, response.state), ("ERROR: the MES refuses: 404 Not Found", 12))
        self.assertEqual(len(self.asked), 1)

    def test_ends_in_time_without_an_mes(self):
        closed = socket.socket()
        self.addCleanup(closed.close)
        closed.bind(("127.0.0.1", 0))  # Taken, without a listener.
        mes_order.url = f"http://127.0.0.1:{closed.getsockname()[1]}/"
        mes_order.TOGETHER = 0.05
        response = testing.call(mes_order.mes_order)
        self.assertEqual(response.state, 13)
        self.assertIn("Connection refused", response.text)

    def test_stops_when_its_call_is_cancelled(self):
        call = testing.FakeCall()
        call.cancel()
        self.assertEqual(mes_order.mes_order(call)[1], 13)
        self.assertEqual(self.asked, [])


class ThePage(InAFolder):
    """docs/how-to/services-in-python.md"""

    def test_has_a_service_and_tests_that_pass(self):
        page = (TOP / "docs/how-to/services-in-python.md").read_text()
        service, tests = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        (self.folder / "length.py").write_text(service)
        sys.path.insert(0, str(self.folder))
        self.addCleanup(sys.path.remove, str(self.folder))
        self.addCleanup(sys.modules.pop, "length", None)
        names = {}
        exec(compile(tests, "services-in-python.md", "exec"), names)
        found = [name for name in names if name.startswith("test_")]
        self.assertEqual(len(found), 2)
        for name in found:
            with self.subTest(name):
                names[name]()


if __name__ == "__main__":
    unittest.main()
