"""The command line that all services share, and the life of a process that serves."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Sequence
from types import FrameType

from millrace import _errors, _library, _server, _service

log = logging.getLogger("millrace")

_LEVELS = {"error": logging.ERROR, "warn": logging.WARNING, "info": logging.INFO, "debug": logging.DEBUG, "trace": 5}

#: Seconds after a signal until the calls that keep the process are named, and between two such lines.
_FIRST_LINE, _NEXT_LINE = 2.0, 10.0

#: Seconds after which a signal is noticed at the latest.
_LONGEST_WAIT = 1.0


class _Formatter(logging.Formatter):
    """The log format of all services; further lines of a record are indented."""

    _NAMES = {"CRITICAL": "error"}

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def format(self, record: logging.LogRecord) -> str:
        moment = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
        level = self._NAMES.get(record.levelname, record.levelname.lower())
        text = super().format(record).replace("\n", "\n    ")
        return f"{moment}.{int(record.msecs):03d}Z {self._name} {level:<5} {text}"


def _number(low: int, high: int) -> object:
    def parse(text: str) -> int:
        if not text.isdecimal() or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {low} to {high}")
        return int(text)

    return parse


def argument_parser(services: Sequence[_service.Service] | None = None) -> argparse.ArgumentParser:
    """A parser with the flags of every service, to which a program adds its own.

        parser = millrace.argument_parser()
        parser.add_argument("--database", required=True)
        arguments = parser.parse_args()
        millrace.run(arguments)
    """
    served = list(_service.registered if services is None else services)
    one = served[0] if len(served) == 1 else None
    parser = argparse.ArgumentParser(
        description=one.description or f"The millrace service {one.name}" if one else "millrace services",
        allow_abbrev=False,
    )
    parser.add_argument("--fabric-config", metavar="FILE", help=(
        "Interface, peers and domain of the fabric (fabric.textproto); default: the file that "
        "MILLRACE_FABRIC_CONFIG names, else /etc/millrace/fabric.textproto, if it is there. Without any of them "
        "nothing leaves this host"))
    parser.add_argument("--domain", type=_number(0, 232), metavar="N",  # type: ignore[arg-type]
                        help="DDS domain to join; overrides the file and MILLRACE_DOMAIN; 0 if none is given")
    parser.add_argument("--fabric", metavar="NAME", help=(
        "Fabric to join within the domain; overrides the file and MILLRACE_FABRIC; millrace if none is given"))
    if one:
        parser.add_argument("--uuid", default=one.uuid, help=f"UUID that NC programs call; else {one.uuid}")
        parser.add_argument("--name", default=one.name, help=f"Name of the service in tools and logs; else {one.name}")
    else:
        parser.set_defaults(uuid=None, name=None)
    parser.add_argument("--channel", action="append", default=[], metavar="MACHINE/N",
                        help="Channel to serve, several times if needed; either part may be *. All, if none is named")
    parser.add_argument("--concurrency", type=_number(1, 256), metavar="N",  # type: ignore[arg-type]
                        help="Calls that may run at the same time, of each service")
    parser.add_argument("--delivery", choices=["at-least-once", "at-most-once"], help=(
        "What happens to a call whose instance is lost: at-least-once gives it to another one, at-most-once blocks it "
        "until an operator decides"))
    parser.add_argument("--completion-signal", choices=["response-state", "response"], help=(
        "What NC programs wait for: RESPONSE_STATE, or a text in RESPONSE alone, which is then written last, and the "
        "state of a response may be 0"))
    parser.add_argument("--log-level", choices=list(_LEVELS), default="info", help="What to log on standard error")
    own = f"{one.name} {one.version} " if one and one.version else ""
    parser.add_argument("--version", action=_Version, own=own)
    return parser


class _Version(argparse.Action):
    """Loads the library only when the flag is given."""

    def __init__(self, option_strings: Sequence[str], dest: str, own: str = "") -> None:
        super().__init__(option_strings, dest, nargs=0, help="Print the version and exit")
        self._own = own

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        version = _library.utf8(_library.library().version())
        print(f"{self._own}(millrace {version})" if self._own else f"{parser.prog} {version}")
        parser.exit()


def _with_flags(service: _service.Service, arguments: argparse.Namespace) -> _service.Service:
    service.uuid = arguments.uuid or service.uuid
    service.name = arguments.name or service.name
    service.channels = arguments.channel or service.channels
    service.concurrency = arguments.concurrency or service.concurrency
    service.delivery = arguments.delivery or service.delivery
    service.completion = arguments.completion_signal or service.completion
    return service


class _Signals:
    """SIGTERM and SIGINT: the first drains, the second ends the process at once, as a crash does."""

    def __init__(self, name: str) -> None:
        self.first: int | None = None
        #: Gets an item for each signal. A signal handler interrupts the waiting thread and may put into this queue; an
        #: Event would wait for its own lock.
        self.news: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._name = name
        self._previous: dict[int, object] = {}

    def __enter__(self) -> _Signals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGTERM, signal.SIGINT):
                # A process that a script starts in the background ignores SIGINT. Keep that.
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._previous[number] = signal.signal(number, self._take)
        return self

    def __exit__(self, *_: object) -> None:
        for number, previous in self._previous.items():
            signal.signal(number, previous)  # type: ignore[arg-type]

    def _take(self, number: int, _frame: FrameType | None) -> None:
        if self.first is not None:
            # Not through a logger: another thread may hold its lock.
            text = "second signal: leaving at once; the running calls go to other instances"
            record = logging.LogRecord("millrace", logging.WARNING, "", 0, text, None, None)
            os.write(2, (_Formatter(self._name).format(record) + "\n").encode())
            os._exit(1)
        self.first = number
        self.news.put(None)


def run(
    arguments: argparse.Namespace | Sequence[str] | None = None,
    *services: _service.Service,
    discovers: bool = False,
) -> None:
    """Serves all services of `@millrace.service` until SIGTERM, SIGINT or an operator's drain command.

    `arguments` is the result of a parser of `millrace.argument_parser()`, or the words of a command line; None: the
    command line of this process. `services` are served instead of all. With `discovers` handlers may call other services.

    Prints one ready line to standard output. The first signal drains: the process takes no new call and answers those
    under way. A second signal ends it at once with exit code 1. Raises SystemExit(2) for a wrong flag, option or file,
    and SystemExit(1) if the fabric cannot be joined or the certificate of the process has ended.
    """
    served = list(services or _service.registered)
    if not served:
        raise _errors.InvalidArgument("no service: decorate a function with @millrace.service")
    if not isinstance(arguments, argparse.Namespace):
        arguments = argument_parser(served).parse_args(arguments)
    name = arguments.name or os.path.basename(sys.argv[0]) or "millrace"
    _set_up_logging(name, arguments.log_level)
    with _Signals(name) as signals:
        try:
            server = _server.Server(
                *[_with_flags(one, arguments) for one in served],
                fabric_config=arguments.fabric_config,
                domain=arguments.domain,
                fabric=arguments.fabric,
                name=name,
                discovers=discovers,
                log_level=arguments.log_level,
            )
        except _errors.Error as error:
            print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
            raise SystemExit(2 if isinstance(error, _errors.InvalidArgument) else 1) from None
        with server:
            _tell_ready(server, name)
            _serve(server, signals)
            expired = server.participant.expired
    if expired:
        raise SystemExit(1)


def _set_up_logging(name: str, level: str) -> None:
    """Unless the program has set it up."""
    root = logging.getLogger()
    if not root.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(_Formatter(name))
        root.addHandler(handler)
        root.setLevel(_LEVELS[level])


def _tell_ready(server: _server.Server, name: str) -> None:
    domain = server.participant.domain
    instances = server.instances
    if len(instances) == 1:
        service, uuid, instance = instances[0]
        what = f"{service.name} serves {uuid} as {instance} on domain {domain}"
    else:
        what = f"{name} serves {len(instances)} UUIDs on domain {domain}"
    print(f"ready: {what}", flush=True)
    _library.library().notify_supervisor(f"READY=1\nSTATUS={what}".encode())


def _serve(server: _server.Server, signals: _Signals) -> None:
    """Until all services have drained."""
    line_at = float("inf")
    drained = threading.Event()

    def wait() -> None:
        server.wait()
        drained.set()
        signals.news.put(None)

    threading.Thread(target=wait, daemon=True).start()
    while not drained.is_set():
        if signals.first is not None and line_at == float("inf"):
            log.info("signal %d: leaving when the running calls are answered", signals.first)
            _library.library().notify_supervisor(b"STOPPING=1")
            server.drain()
            line_at = time.monotonic() + _FIRST_LINE
        if time.monotonic() >= line_at:
            line_at = time.monotonic() + _NEXT_LINE
            for service, call, seconds in server.calls:
                log.warning(
                    "call %s of %s has been in its handler for %.0f s; a second signal ends the process at once, and "
                    "the gateway treats the call as after a crash", call, service, seconds)
        # Signal handlers run in this thread, and interrupt its wait. One that comes just before the wait begins runs only
        # when it ends.
        with contextlib.suppress(queue.Empty):
            signals.news.get(timeout=min(_LONGEST_WAIT, max(0.05, line_at - time.monotonic())))
