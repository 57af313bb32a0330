"""Python services as processes on a fabric, and the functions that call and watch them. Pinned to the loopback."""

import ctypes
import datetime
import pathlib
import re
import signal
import sys
import tempfile
import threading
import time
import unittest
from concurrent.futures import ThreadPoolExecutor

import millrace
import obedient
from millrace import testing
from support import BIN, PATIENCE, TOP, Domain, Process

UNKNOWN = "b0ad0000-0000-4000-8000-00000000000f"


class _Left(Exception):
    pass


def _leave(_interim):
    raise _Left


class OnAFabric(unittest.TestCase):
    def setUp(self):
        self.domain = Domain()
        self.addCleanup(self.domain.close)
        millrace.connect(domain=self.domain.number)
        self.addCleanup(millrace.disconnect)

    def start(self, script="obedient.py", *arguments, **environment):
        process = Process.python(script, "--domain", self.domain.number, *arguments, **environment)
        self.addCleanup(process.__exit__)
        process.ready = process.await_output(r"^ready: (.*)$").group(1)
        return process

    @staticmethod
    def instance_of(process):
        """The id in its ready line."""
        return re.search(r" as (\S+) on domain", process.ready).group(1)

    def call(self, text, uuid=obedient.UUID, **options):
        return millrace.call(uuid, text, timeout=PATIENCE, **options)

    def cancel(self, text, uuid=obedient.UUID):
        """Calls, and cancels the call at its first interim response."""
        with self.assertRaises(_Left):
            self.call(text, uuid, interim=_leave)


class APythonService(OnAFabric):
    def test_reports_once_that_it_is_ready_and_answers(self):
        sut = self.start("obedient.py", "--log-level", "debug")
        self.assertRegex(sut.ready, rf"^obedient serves {obedient.UUID} as \S+ on domain {self.domain.number}$")
        response = self.call("hello", state=7)
        self.assertEqual((response.text, response.state, response.result), ("hello, attempt 1", 7, "ok"))
        self.assertIn(response.instance, sut.ready)
        self.assertGreater(response.duration, 0)
        deadline = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=PATIENCE)
        told = re.fullmatch(r"call/\d+ 3 1 (\S+ \S+) False", self.call("who", state=3).text)
        self.assertAlmostEqual(datetime.datetime.fromisoformat(told.group(1)), deadline,
                               delta=datetime.timedelta(seconds=PATIENCE))
        sut.await_error(rf'^\S+Z obedient debug call {response.call_id} from \S+: "hello", state 7, attempt 1$')

    def test_returns_the_error_response_for_an_exception_with_an_umlaut(self):
        sut = self.start()
        response = self.call("raise die Messuhr in Köln fehlt")
        self.assertEqual((response.text, response.state), ("ERROR: die Messuhr in Köln fehlt", 500))
        self.assertEqual((response.result, response.ok), ("failed", False))
        sut.await_error("ValueError: die Messuhr in Köln fehlt")

    def test_answers_as_its_test_bench_does(self):
        self.start()
        for text in ("hello", "long", "state 0", "state 7", "foreign", "nothing", "raise" + " ü" * 60, "exit",
                     "interim"):
            real = self.call(text)
            bench = testing.call(obedient.obey, text)
            self.assertEqual((real.text, real.state, real.result), (bench.text, bench.state, bench.result), text)

    def test_continues_after_a_handler_that_calls_sys_exit(self):
        sut = self.start()
        self.assertEqual(self.call("exit").text, "ERROR: the handler called sys.exit(3); the service goes on")
        self.assertEqual(self.call("hello").text, "hello, attempt 1")
        sut.signal()
        self.assertEqual(sut.wait(), 0, sut.errors.text)

    def test_shows_interim_responses(self):
        self.start()
        seen = []
        self.assertEqual(self.call("interim", interim=seen.append).text, "all the way")
        self.assertEqual([(one.text, one.state) for one in seen], [("half way", 50)])

    def test_answers_later_and_declines(self):
        self.start()
        later = self.call("later tomorrow")
        self.assertEqual((later.text, later.state), ("tomorrow", 4))
        self.assertEqual(self.call("decline").text, "decline, attempt 2")

    def test_runs_as_many_calls_at_once_as_its_concurrency(self):
        self.start("obedient.py", "--concurrency", "4")
        with ThreadPoolExecutor(4) as pool:
            results = list(pool.map(self.call, ["together"] * 4))
        self.assertEqual({one.text for one in results}, {"True"})

    def test_is_notified_of_a_cancelled_call(self):
        sut = self.start()
        self.cancel("cancel")
        sut.await_output("^cancelled")
        self.assertEqual(self.call("hello").text, "hello, attempt 1")

    def test_loses_no_call_when_an_instance_is_killed(self):
        first = self.start()
        with ThreadPoolExecutor(1) as pool:
            pending = pool.submit(self.call, "hold")
            first.await_output("^holding")
            second = self.start()
            first.signal(signal.SIGKILL)
            second.await_output("^holding")
            second_release = self.call("release")
            self.assertEqual((second_release.text, pending.result().text), ("done", "released"))

    def test_blocks_an_at_most_once_call_when_its_instance_is_killed(self):
        first = self.start("obedient.py", "--delivery", "at-most-once")
        with ThreadPoolExecutor(1) as pool:
            pending = pool.submit(self.call, "hold")
            first.await_output("^holding")
            second = self.start("obedient.py", "--delivery", "at-most-once")
            first.signal(signal.SIGKILL)
            with self.assertRaisesRegex(millrace.NoResponse, "must not run twice"):
                pending.result()
        self.assertEqual(self.call("hello").text, "hello, attempt 1")
        self.assertNotIn("holding", second.output.text)

    def test_is_replaced_by_another_instance_while_it_is_frozen(self):
        first = self.start()
        with ThreadPoolExecutor(1) as pool:
            pending = pool.submit(self.call, "hold")
            first.await_output("^holding")
            second = self.start()
            first.signal(signal.SIGSTOP)
            second.await_output("^holding")
            self.assertEqual(self.call("release").text, "done")
            self.assertEqual(pending.result().text, "released")
            first.signal(signal.SIGCONT)
        second.signal()
        self.assertEqual(second.wait(), 0, second.errors.text)
        self.assertEqual(self.call("hello").text, "hello, attempt 1")

    def test_drains_at_an_operators_command(self):
        sut = self.start()
        with ThreadPoolExecutor(1) as pool:
            pending = pool.submit(self.call, "hold")
            sut.await_output("^holding")
            with Process(BIN / "millrace", "drain", "--domain", self.domain.number, obedient.UUID) as command:
                self.assertEqual(command.wait(), 0, command.errors.text)
            sut.await_error("commands this instance to leave")
            other = self.start()
            self.assertEqual(self.call("who").instance, self.instance_of(other))
            self.assertFalse(pending.done())
            sut.signal(signal.SIGUSR1)
            self.assertEqual(pending.result().text, "released")
        self.assertEqual(sut.wait(), 0, sut.errors.text)

    def test_drains_on_sigterm_and_ends_by_a_second_signal(self):
        sut = self.start()
        with ThreadPoolExecutor(1) as pool:
            pending = pool.submit(self.call, "hold")
            sut.await_output("^holding")
            sut.signal()
            sut.await_error("signal 15: leaving when the running calls are answered")
            sut.await_error(r"call \S+ of obedient has been in its handler for \d+ s; a second signal")
            with self.assertRaises(millrace.NoResponse):
                millrace.call(obedient.UUID, "release", timeout=0.5)
            self.assertFalse(pending.done())
            sut.signal(signal.SIGINT)
            self.assertEqual(sut.wait(), 1)
            other = self.start()
            other.await_output("^holding")
            self.call("release")
            self.assertEqual(pending.result().text, "released")

    def test_ends_with_exit_code_0_when_its_last_call_is_answered(self):
        sut = self.start()
        with ThreadPoolExecutor(2) as pool:
            pending = pool.submit(self.call, "hold")
            sut.await_output("^holding")
            self.call("release")
            sut.signal()
            self.assertEqual(pending.result().text, "released")
        self.assertEqual(sut.wait(), 0, sut.errors.text)

    def test_ends_by_a_second_signal_during_an_endless_handler(self):
        sut = self.start()
        self.cancel("spin")
        sut.signal()
        sut.await_error("signal 15: leaving")
        sut.signal()
        self.assertEqual(sut.wait(), 1)
        sut.await_error("second signal: leaving at once")

    def test_ends_the_child_of_a_handler_that_forks_and_returns_in_it(self):
        sut = self.start()
        self.assertEqual(self.call("fork").text, "the child ended with 1")
        sut.await_error("the handler has forked, and its child has returned; the child ends here")
        self.assertEqual(self.call("hello").text, "hello, attempt 1")
        sut.signal()
        self.assertEqual(sut.wait(), 0, sut.errors.text)

    def test_ends_in_order_while_its_handlers_run(self):
        for how, code in (("return", 0), ("exit", 7), ("raise", 1)):
            with Process.python("leaves.py", self.domain.number, how) as sut:
                sut.await_output("^ready")
                self.cancel("", "b0ad0000-0000-4000-8000-000000000004")
                sut.signal(signal.SIGUSR1)
                self.assertEqual(sut.wait(), code, sut.errors.text)
                expected = "RuntimeError: the program is over" if how == "raise" else ""
                self.assertEqual(sut.errors.text.strip().rpartition("\n")[2], expected)

    def test_answers_calls_that_come_while_its_interpreter_shuts_down(self):
        with Process.python("leaves.py", self.domain.number, "late") as sut:
            sut.await_output("^ready")
            sut.signal(signal.SIGUSR1)
            sut.await_output("^leaving")
            for uuid in ("b0ad0000-0000-4000-8000-000000000004", "b0ad0000-0000-4000-8000-000000000005"):
                self.assertEqual(self.call("late", uuid).text, "late")
            sut.signal(signal.SIGUSR1)
            self.assertEqual(sut.wait(), 0, sut.errors.text)
            self.assertEqual(sut.errors.text, "")

    def test_shares_its_calls_with_an_instance_in_cpp_and_leaves_them_to_it(self):
        uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47"
        python = self.start("square_root.py")
        with Process(BIN / "millrace-square-root", "--domain", self.domain.number) as cpp:
            cpp.await_output("^ready: ")
            answering = set()
            while len(answering) < 2:
                response = self.call("2.25", uuid)
                self.assertEqual(response.text, "1.500000")
                answering.add(response.instance)
            python.signal(signal.SIGKILL)
            with ThreadPoolExecutor(4) as pool:
                texts = list(pool.map(lambda _: self.call("2.25", uuid).text, range(20)))
            self.assertEqual(texts, ["1.500000"] * 20)

    def test_calls_another_service_if_it_discovers(self):
        self.start("coroutines.py")
        sut = self.start()
        self.assertEqual(self.call("call " + UNKNOWN).state, 500)
        sut.await_error(r"for handlers that call services write millrace\.run\(discovers=True\)")
        sut.signal()
        self.assertEqual(sut.wait(), 0)
        self.start("obedient.py", "--discovers")
        self.assertEqual(self.call("call b0ad0000-0000-4000-8000-000000000003").text, "it said: alone")

    def test_accepts_the_command_line_of_every_service(self):
        def flags(*command):
            with Process(*command) as program:
                self.assertEqual(program.wait(), 0, program.errors.text)
                return set(re.findall(r"(?<![\w-])--[a-z-]+", program.output.text))

        own = flags(sys.executable, TOP / "tests/python/obedient.py", "--help")
        self.assertEqual(own - {"--discovers"}, flags(BIN / "millrace-square-root", "--help"))

    def test_announces_the_options_of_its_command_line(self):
        self.start("obedient.py", "--uuid", "Weather", "--name", "weather", "--channel", "cnc/1", "--channel", "press/*",
                   "--concurrency", "4", "--delivery", "at-most-once", "--completion-signal", "response")
        (instance,) = millrace.services()
        self.assertEqual((instance.uuid, instance.name, instance.version), ("Weather", "weather", "1.2"))
        self.assertEqual(instance.description, "Follows the instruction in its request.")
        self.assertEqual(instance.channels, ["cnc/1", "press/*"])
        self.assertEqual((instance.concurrency, instance.delivery, instance.completion), (4, "at-most-once", "response"))

    def test_refuses_a_wrong_command_line(self):
        for arguments, message in (
            (["--channel", "cnc/0"], "channels: 'cnc/0' is not a channel"),
            (["--uuid", "a*"], "wildcard"),
            (["--domain", "300"], "'300' is not a number from 0 to 232"),
            (["--fabric-config", "/nowhere"], "/nowhere"),
            (["--fabric", "a/b"], "'a/b' is not a fabric name"),
            (["--concurency", "3"], "unrecognized arguments: --concurency"),
        ):
            with Process.python("obedient.py", *arguments) as sut:
                self.assertEqual(sut.wait(), 2)
                self.assertIn(message, sut.errors.text)
                self.assertNotIn("Traceback", sut.errors.text)

    def test_prints_its_own_version_and_that_of_the_library(self):
        with Process.python("obedient.py", "--version") as sut:
            self.assertEqual(sut.wait(), 0)
            self.assertRegex(sut.output.text, r"^obedient 1\.2 \(millrace \d+\.\d+\.\d+(-rc\.\d+)?\)\n$")

    def test_joins_the_fabric_that_the_environment_names(self):
        with Process.python("obedient.py", MILLRACE_DOMAIN=str(self.domain.number)) as sut:
            sut.await_output(f"on domain {self.domain.number}$")
            self.assertEqual(self.call("hello").text, "hello, attempt 1")


class ACoroutine(OnAFabric):
    UUID = "b0ad0000-0000-4000-8000-000000000003"

    def setUp(self):
        super().setUp()
        self.sut = self.start("coroutines.py")

    def test_answers_beside_others_in_one_thread(self):
        with ThreadPoolExecutor(3) as pool:
            results = list(pool.map(lambda _: millrace.call(self.UUID, "together", timeout=PATIENCE).text, range(3)))
        self.assertEqual(results, ["together"] * 3)
        self.assertEqual(millrace.call(self.UUID, "raise").text, "ERROR: Größe fehlt")

    def test_is_cancelled_with_its_call(self):
        self.cancel("cancel", self.UUID)
        self.sut.await_output("^cancelled")
        self.assertEqual(millrace.call(self.UUID, "x").text, "alone")

    def test_is_cancelled_with_its_call_also_after_a_pause_without_calls(self):
        self.call("pause", self.UUID)
        self.sut.await_output("^paused")
        self.cancel("cancel", self.UUID)
        self.sut.await_output("^cancelled")

    def test_drains_on_sigterm(self):
        self.sut.signal()
        self.assertEqual(self.sut.wait(), 0, self.sut.errors.text)
        self.assertEqual(self.sut.errors.text.count("\n"), 1, self.sut.errors.text)


class ACaller(OnAFabric):
    def test_raises_unserved_where_no_instance_has_the_uuid(self):
        self.start()
        with self.assertRaisesRegex(millrace.Unserved, UNKNOWN):
            millrace.call(UNKNOWN, "hello")

    def test_refuses_a_request_that_no_nc_program_can_make(self):
        for text, message in (("x" * 128, "128 bytes"), ("中", "not in CP1252")):
            with self.assertRaisesRegex(millrace.InvalidArgument, message):
                millrace.call(obedient.UUID, text)
        with self.assertRaisesRegex(millrace.InvalidArgument, "REQUEST_STATE is 0"):
            millrace.call(obedient.UUID, "", state=0)

    def test_lists_instances_and_watches_events(self):
        sut = self.start()
        (instance,) = millrace.services()
        self.assertEqual((instance.uuid, instance.name, instance.pid), (obedient.UUID, "obedient", sut.pid))
        self.assertEqual((instance.channels, instance.delivery, instance.draining), ([], "at-least-once", False))
        with millrace.watch(alarms=False, timeout=PATIENCE) as events:
            self.call("hello", state=7)
            seen = {}
            while "replied" not in seen:
                event = next(events)
                seen[event.kind] = event
        self.assertEqual((seen["seen"].text, seen["seen"].state), ("hello", 7))
        self.assertEqual(seen["dispatched"].instance, instance.id)
        self.assertEqual((seen["replied"].text, seen["replied"].instance), ("hello, attempt 1", instance.id))
        self.assertAlmostEqual(seen["replied"].time, time.time(), delta=PATIENCE)

    def test_ends_a_watch_after_its_time(self):
        self.assertEqual(list(millrace.watch(timeout=0.1)), [])

    def test_may_be_interrupted(self):
        sut = self.start()

        def interrupt():
            sut.await_output("^hanging")
            signal.raise_signal(signal.SIGINT)

        thread = threading.Thread(target=interrupt)
        thread.start()
        with self.assertRaises(KeyboardInterrupt):
            self.call("hang")
        thread.join()

    def test_uses_its_channels_again(self):
        """A service accepts 4,096 of them from a process."""
        self.start()
        self.assertEqual({self.call("who").text.split()[0] for _ in range(10)}, {"call/1"})

    def test_shares_the_participant_of_a_server_that_discovers(self):
        millrace.disconnect()
        participants = ctypes.CDLL("libddsc.so.0debian").dds_lookup_participant
        other = millrace.Service(lambda call: "other", uuid=UNKNOWN, name="other")
        with millrace.Server(obedient.obey, other, domain=self.domain.number, discovers=True):
            self.assertEqual(self.call("hello").text, "hello, attempt 1")
            self.assertEqual(self.call("hello", UNKNOWN).text, "other")
            self.assertEqual(participants(self.domain.number, None, 0), 1)


class OnAFabricWithTrust(OnAFabric):
    def setUp(self):
        super().setUp()
        millrace.disconnect()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.plant = pathlib.Path(folder.name, "plant")
        self.trust("init")

    def trust(self, word, *arguments):
        with Process(BIN / "millrace", "trust", word, self.plant, *arguments) as process:
            self.assertEqual(process.wait(), 0, process.errors.text)

    def issue(self, name, *flags):
        """A fabric configuration with new credentials."""
        self.trust("issue", name, *flags)
        file = self.plant.parent / f"{name}.textproto"
        file.write_text(f'interface: "lo"\ndomain: {self.domain.number}\ntrust {{ folder: "{self.plant / name}" }}\n')
        return file

    def test_a_tester_calls_a_service_and_lists_it_with_its_certificate(self):
        self.start("obedient.py", "--fabric-config", self.issue("gauge", "--role", "service", "--uuid", obedient.UUID))
        millrace.connect(fabric_config=self.issue("bench", "--role", "tester", "--role", "observer"))
        self.assertEqual(self.call("hello").text, "hello, attempt 1")
        (instance,) = millrace.services()
        self.assertIn("gauge", instance.certificate)

    def test_a_tester_may_not_serve(self):
        config = self.issue("bench", "--role", "tester")
        with self.assertRaisesRegex(millrace.Error, "may not write"):
            millrace.Server(obedient.obey, fabric_config=config, discovers=True)


class AnNcProgram(OnAFabric):
    def run_program(self, program):
        """A virtual CNC, and a gateway for it."""
        cnc = Process(BIN / "millrace-cnc", "--listen", "127.0.0.1:0", "--channels", "2", "--run", f"1={program}",
                      "--exit-when-idle")
        self.addCleanup(cnc.__exit__)
        port = cnc.await_output(r"^ready: .* on 127\.0\.0\.1:(\d+)").group(1)
        gateway = Process(BIN / "millrace-gateway", "--domain", self.domain.number, "--machine",
                          f"cnc=127.0.0.1:{port}/127.0.0.1.1.1")
        self.addCleanup(gateway.__exit__)
        return cnc

    def program(self, request):
        """A program that makes one call of the obedient service and shows the response."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        file = pathlib.Path(folder.name, "call.nc")
        file.write_text(f"""%call
N10 V.G.SERVICE.UUID = "{obedient.UUID}"
N20 V.G.SERVICE.REQUEST = "{request}"
N30 V.G.SERVICE.REQUEST_STATE = 1
N40 #FLUSH CONTINUE
N50 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N60 #MSG ["state %u: %s", V.G.SERVICE.RESPONSE_STATE, V.G.SERVICE.RESPONSE]
N70 M30
""")
        return file

    def expect(self, cnc, line):
        self.assertEqual(cnc.wait(), 0, cnc.errors.text)
        self.assertIn(f"[ch1] {line}\n", cnc.output.text)

    def test_calls_a_python_service_through_the_gateway(self):
        self.start("square_root.py")
        cnc = self.run_program(TOP / "tests/data/nc/chain/square_root_of_3.nc")
        self.expect(cnc, "response = 1.732051")

    def test_gets_the_error_text_of_an_exception(self):
        self.start()
        self.expect(self.run_program(self.program("raise the gauge is missing")), "state 500: ERROR: the gauge is missing")

    def test_gets_the_response_of_another_instance_when_its_own_is_killed(self):
        first = self.start()
        cnc = self.run_program(self.program("hold"))
        first.await_output("^holding")
        second = self.start()
        first.signal(signal.SIGKILL)
        second.await_output("^holding")
        second.signal(signal.SIGUSR1)
        self.expect(cnc, "state 1: released")

    def test_waits_for_an_operator_when_the_instance_of_its_at_most_once_call_is_killed(self):
        first = self.start("obedient.py", "--delivery", "at-most-once")
        with millrace.watch(alarms=False, timeout=PATIENCE) as events:
            cnc = self.run_program(self.program("hold"))
            first.await_output("^holding")
            second = self.start("obedient.py", "--delivery", "at-most-once")
            first.signal(signal.SIGKILL)
            while next(events).kind != "held":
                pass
        with Process(BIN / "millrace", "answer", "--domain", self.domain.number, "cnc/1", "not available",
                     "--state", "99") as operator:
            self.assertEqual(operator.wait(), 0, operator.errors.text)
        self.expect(cnc, "state 99: not available")
        self.assertNotIn("holding", second.output.text)


if __name__ == "__main__":
    unittest.main()
