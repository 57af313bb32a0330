"""Handlers without a fabric: the answers for returned values and exceptions, and the test bench itself."""

import asyncio
import ctypes
import pathlib
import queue
import re
import signal
import threading
import unittest

import millrace
from millrace import _library, _program, testing

HEADER = pathlib.Path(__file__).parents[2] / "services/c/millrace.h"


def length(call):
    return str(len(call.text))


class ASignal(unittest.TestCase):
    def test_is_noticed_although_it_comes_just_before_the_wait(self):
        class News(queue.SimpleQueue):
            def get(self, timeout):
                # As a signal whose handler runs once the wait is over.
                signals.first = signal.SIGTERM
                return super().get(timeout=timeout)

        class Server:
            calls = ()

            def __init__(self):
                self.drained = threading.Event()
                self.wait, self.drain = self.drained.wait, self.drained.set

        signals = _program._Signals("sut")
        signals.news = News()
        sut = threading.Thread(target=_program._serve, args=(Server(), signals), daemon=True)
        sut.start()
        sut.join(30)
        self.assertFalse(sut.is_alive())


class TheMirrorOfTheHeader(unittest.TestCase):
    TYPES = {
        "const char*": ctypes.c_char_p,
        "int32_t": ctypes.c_int32,
        "int64_t": ctypes.c_int64,
        "uint16_t": ctypes.c_uint16,
        "uint32_t": ctypes.c_uint32,
        "uint64_t": ctypes.c_uint64,
        "size_t": ctypes.c_size_t,
        "void*": ctypes.c_void_p,
        "millrace_handler": ctypes.c_void_p,
        "millrace_log_function": _library.LogFunction,
    }

    def test_has_each_structure_member_for_member(self):
        header = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.DOTALL)
        structures = re.findall(r"typedef struct millrace_(\w+) \{(.*?)\}", header, re.DOTALL)
        self.assertGreater(len(structures), 8)
        for name, members in structures:
            sut = getattr(_library, name.title().replace("_", ""))
            declared = [(member, self.TYPES[kind]) for kind, member in re.findall(r"(\S.*) (\w+);", members)]
            self.assertEqual(sut._fields_, declared, name)


class AHandler(unittest.TestCase):
    def test_returns_a_text_a_text_with_its_state_or_a_response(self):
        self.assertEqual(testing.call(length, "hello"), millrace.Response("5", 1))
        self.assertEqual(testing.call(lambda call: ("5", 7), "hello"), millrace.Response("5", 7))
        self.assertEqual(testing.call(lambda call: millrace.Response("5", 8)), millrace.Response("5", 8))
        self.assertEqual(testing.call(lambda call: b"Ma\xdf"), millrace.Response("Maß", 1))

    def test_may_be_a_coroutine(self):
        async def slow(call):
            await asyncio.sleep(0)
            return call.text

        self.assertEqual(testing.call(slow, "hello").text, "hello")

    def test_gets_characters_of_cp1252_and_returns_them(self):
        every = bytes(byte for byte in range(1, 128)).decode()
        self.assertEqual(testing.call(lambda call: call.text, every).text, every)
        high = bytes(range(128, 255))
        sut = testing.FakeCall(high)
        self.assertEqual(len(sut.text), 127)
        sut.answer(sut.text)
        self.assertEqual(sut.response.text, sut.text)
        self.assertEqual(testing.FakeCall("€").data, b"\x80")

    def test_names_a_character_that_is_not_in_cp1252(self):
        response = testing.call(lambda call: "a中")
        self.assertEqual(response.result, "failed")
        self.assertEqual(response.state, 500)
        self.assertIn("'?' (U+4E2D, character 2 of the text) is not in CP1252", response.text)

    def test_gets_an_error_response_for_what_cannot_be_sent(self):
        for result, text in (
            ("x" * 128, "ERROR: the service's answer has 128 bytes, at most 127 fit"),
            (("x", 0), "ERROR: the service answered with state 0, which would not release the program"),
            ("a\0b", "ERROR: the service's answer contains a NUL byte"),
        ):
            response = testing.call(lambda call, result=result: result)
            self.assertEqual((response.text, response.state, response.result), (text, 500, "refused"))
        for result, text in (
            (None, "the handler returned NoneType; expected str"),
            (("x", "1"), "a state is an int, not str"),
            (("x", -1), "the state -1 does not fit into 32 bits"),
            (("x", 1, 2), "the handler returned a tuple of 3"),
        ):
            response = testing.call(lambda call, result=result: result)
            self.assertIn(text, response.text)
            self.assertEqual(response.result, "failed")

    def test_turns_an_exception_into_an_error_response(self):
        def broken(call):
            raise ValueError("die Messuhr fehlt in Köln, 中")

        self.assertEqual(testing.call(broken).text, "ERROR: die Messuhr fehlt in Köln, ?")
        self.assertEqual(testing.call(broken, error_state=99).state, 99)

        def nameless(call):
            raise KeyError

        self.assertEqual(testing.call(nameless).text, "ERROR: KeyError")

    def test_cuts_a_long_exception(self):
        def broken(call):
            raise ValueError("x" * 200)

        text = testing.call(broken).text
        self.assertEqual(len(text), 127)
        self.assertTrue(text.endswith("..."))

    # A regression: the service ended, with exit code 0.
    def test_whose_exception_has_no_text_to_get_ends_only_its_call(self):
        class Silent(Exception):
            def __str__(self):
                raise SystemExit(0)

        def raise_it(error):
            raise error

        response = testing.call(lambda call: raise_it(Silent()))
        self.assertEqual(response.text, "ERROR: Silent (its text cannot be made)")
        self.assertEqual(response.result, "failed")
        self.assertEqual(testing.call(lambda call: raise_it(ValueError(Silent()))).result, "failed")

    def test_that_returns_an_object_which_raises_ends_only_its_call(self):
        class Hostile(str):
            def encode(self, *arguments):
                raise SystemExit(0)

            def __str__(self):
                raise SystemExit(0)

        for result in (Hostile("x"), (Hostile("x"), 1), object(), (object(), object()), Hostile):
            self.assertIn(testing.call(lambda call, result=result: result).result, ("ok", "failed"))

    def test_whose_exception_is_long_or_has_control_characters_writes_a_short_clean_line(self):
        for text in ("x" * 10_000_000, "\x1b[2J\r\n2026-01-01 forged line", "\u202eevil\u0085"):

            def fails(call, text=text):
                raise ValueError(text)

            with self.assertLogs("millrace", "ERROR") as logged:
                testing.call(fails)
            lines = "\n".join(record.getMessage() for record in logged.records)
            self.assertLess(len(lines), 5000)
            self.assertNotRegex(lines, "[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
            self.assertNotIn("\n2026", lines)

    def test_that_calls_sys_exit_ends_only_its_call(self):
        def leaving(call):
            raise SystemExit(3)

        self.assertEqual(testing.call(leaving).text, "ERROR: the handler called sys.exit(3); the service goes on")

    def test_declines(self):
        def busy(call):
            raise millrace.Decline("the gauge is in use")

        with self.assertRaisesRegex(millrace.Decline, "in use"):
            testing.call(busy)

    def test_answers_later_once(self):
        def later(call):
            threading.Thread(target=call.answer, args=("done", 4)).start()
            return millrace.LATER

        self.assertEqual(testing.call(later), millrace.Response("done", 4))
        sut = testing.FakeCall()
        sut.answer("1")
        with self.assertRaises(millrace.Ended):
            sut.answer("2")

    def test_shows_interim_responses(self):
        sut = testing.FakeCall()
        sut.interim("half way", 50)
        with self.assertRaises(millrace.InvalidArgument):
            sut.interim("x" * 128, 50)
        with self.assertRaises(millrace.TextError):
            sut.interim("中", 50)
        sut.cancel()
        sut.interim("too late", 60)
        self.assertEqual(sut.interims, [millrace.Response("half way", 50)])

    def test_of_programs_that_wait_for_the_text_may_have_state_0_and_no_interim_response(self):
        @millrace.service("u", completion="response")
        def text_alone(call):
            call.interim("half way", 50)
            return call.text, 0

        self.assertEqual(testing.call(text_alone, "1"), millrace.Response("1", 0))
        self.assertEqual(testing.call(text_alone, "").result, "refused")

    def test_that_is_a_coroutine_is_cancelled_with_its_call(self):
        stopped = threading.Event()

        @millrace.service("u")
        async def slow(call):
            try:
                await asyncio.sleep(60)
            finally:
                stopped.set()

        with testing.Loopback(slow) as loopback:
            pending = loopback.send(slow)
            pending.withdraw()
            self.assertTrue(stopped.wait(testing.PATIENCE))


class ALoopback(unittest.TestCase):
    def setUp(self):
        self.go = threading.Event()
        self.ran = []

    def slow(self, **options):
        @millrace.service("u", **options)
        def slow(call):
            self.ran.append(call.attempt)
            self.go.wait(testing.PATIENCE)
            return call.text

        return slow

    def test_dispatches_each_call_to_one_instance(self):
        slow = self.slow()
        with testing.Loopback(slow, instances=2) as sut:
            first, second, third = (sut.send(slow, text) for text in "123")
            self.assertEqual({first.instance, second.instance}, {0, 1})
            self.assertEqual(third.attempt, 0, "it waits for room")
            self.go.set()
            self.assertEqual([one.wait().text for one in (first, second, third)], ["1", "2", "3"])
        self.assertEqual(self.ran, [1, 1, 1])

    def test_dispatches_the_call_of_a_lost_instance_again(self):
        slow = self.slow()
        with testing.Loopback(slow, instances=2) as sut:
            pending = sut.send(slow, "3")
            sut.kill(pending.instance)
            self.go.set()
            self.assertEqual(pending.wait().text, "3")
            self.assertEqual(pending.attempt, 2)

    def test_holds_the_call_of_a_lost_instance_that_may_run_at_most_once(self):
        slow = self.slow(delivery="at-most-once")
        with testing.Loopback(slow, instances=2) as sut:
            pending = sut.send(slow, "3")
            sut.kill(pending.instance)
            with self.assertRaisesRegex(millrace.NoResponse, "held"):
                pending.wait()
            self.go.set()
        self.assertEqual(self.ran, [1])

    def test_answers_a_repeat_from_memory(self):
        slow = self.slow()
        self.go.set()
        with testing.Loopback(slow) as sut:
            pending = sut.send(slow, "3")
            self.assertEqual(pending.wait(), millrace.Response("3"))
            pending.repeat()
            self.assertEqual(pending.wait(), millrace.Response("3", result="repeated"))
        self.assertEqual(self.ran, [1])

    def test_drops_the_response_to_a_withdrawn_call(self):
        slow = self.slow()
        with testing.Loopback(slow) as sut:
            pending = sut.send(slow, "3")
            pending.withdraw()
            self.assertTrue(pending.fake.cancelled)
            self.go.set()
            with self.assertRaisesRegex(millrace.NoResponse, "withdrawn"):
                pending.wait()
            self.assertEqual(sut.call(slow, "4").text, "4")
            self.assertEqual(pending.responses, 0)

    def test_starts_an_instance_for_a_call_that_waits(self):
        slow = self.slow()
        self.go.set()
        with testing.Loopback() as sut:
            pending = sut.send(slow, "3")
            self.assertEqual(pending.attempt, 0)
            sut.start(slow)
            self.assertEqual(pending.wait().text, "3")


if __name__ == "__main__":
    unittest.main()
