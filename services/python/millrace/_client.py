"""Calls services, lists instances, watches calls and alarms."""

from __future__ import annotations

import atexit
import ctypes
import dataclasses
import os
import threading
import time
from collections.abc import Callable, Iterator

from millrace import _call, _errors, _library, _server, _text
from millrace._participant import Participant

#: Seconds of one wait in the library. Python runs signal handlers between two waits.
_SLICE = 0.2

_RESULTS = {0: "ok", 1: "failed", 2: "repeated", 3: "refused"}

_lock = threading.Lock()
_own: Participant | None = None


def connect(
    *,
    fabric_config: str | os.PathLike[str] | None = None,
    domain: int | None = None,
    fabric: str | None = None,
    name: str | None = None,
) -> None:
    """Joins a fabric for `call()`, `services()` and `watch()` of this process.

    Without it the first of them joins the fabric that the environment and /etc/millrace/fabric.textproto describe.
    Raises NotConnected, and InvalidArgument for a wrong file.
    """
    global _own
    with _lock:
        previous, _own = _own, None
        if previous is not None:
            previous.close()
        _own = Participant(fabric_config=fabric_config, domain=domain, fabric=fabric, name=name, discovers=True)


@atexit.register
def disconnect() -> None:
    """Leaves the fabric of `connect()`."""
    global _own
    with _lock:
        previous, _own = _own, None
    if previous is not None:
        previous.close()


def _participant() -> Participant:
    global _own
    with _lock:
        if _own is not None:
            return _own
        server = _server.any_server()
        if server is not None:
            if not server.participant.discovers:
                raise _errors.InvalidArgument(
                    "this process serves, and discovers no other process; for handlers that call services write "
                    "millrace.run(discovers=True)"
                )
            return server.participant
        _own = Participant(discovers=True)
        return _own


def _milliseconds(seconds: float) -> int:
    return max(1, min(int(seconds * 1000), _library.FOREVER - 1))


class _Request:
    def __init__(
        self, uuid: str, text: str | bytes, state: int, timeout: float, machine: str | None, channel: int
    ) -> None:
        self._library = _library.library()
        self._handle: ctypes.c_void_p | None = None
        data = _text.encode(text)
        options = _library.RequestOptions(
            uuid=_library.option(uuid),
            text=data,
            text_length=len(data),
            state=state,
            machine=_library.option(machine),
            channel=channel,
            timeout_ms=_milliseconds(timeout),
        )
        handle = ctypes.c_void_p()
        _library.check(
            self._library.request_send(_participant().handle, ctypes.byref(options), ctypes.byref(handle))
        )
        self._handle = handle

    def wait(self) -> tuple[bool, _call.Response] | None:
        """Whether the next response is the final one, and the response; None if none came within one wait."""
        answer = ctypes.POINTER(_library.Response)()
        code = _library.check(self._library.request_wait(self._handle, int(_SLICE * 1000), ctypes.byref(answer)))
        if code == _library.NOTHING:
            return None
        response = answer.contents
        result = _RESULTS.get(response.result, "failed")
        return code == _library.OK, _library.filled(
            _call.Response, response, text=_text.decode(response.text), result=result
        )

    def __enter__(self) -> _Request:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.request_free(self._handle)


def call(
    uuid: str,
    text: str | bytes = "",
    *,
    state: int = 1,
    timeout: float = 10.0,
    machine: str | None = None,
    channel: int = 1,
    interim: Callable[[_call.Response], object] | None = None,
) -> _call.Response:
    """Calls a service without a controller and returns its final response.

    `text` is REQUEST, at most 127 bytes of CP1252; `state` is REQUEST_STATE, not 0; `timeout` is in seconds. With
    `machine` the instance is chosen as for a call of this machine's `channel`. `interim` is called with each interim
    response. Raises Unserved if no instance has this UUID after 1 s, NoResponse after the time-out, InvalidArgument for
    a request that no NC program could make. An error response of the service is a response: look at its `ok` and
    `state`.
    """
    if not state:
        raise _errors.InvalidArgument("REQUEST_STATE is 0; expected 1 to 4294967295")
    with _Request(uuid, text, state, timeout, machine, channel) as request:
        while True:
            answer = request.wait()
            if answer is None:
                continue
            final, response = answer
            if final:
                return response
            if interim is not None:
                interim(response)


async def call_async(
    uuid: str,
    text: str | bytes = "",
    *,
    state: int = 1,
    timeout: float = 10.0,
    machine: str | None = None,
    channel: int = 1,
) -> _call.Response:
    """As `call()`, for `async def` handlers; it waits in a thread."""
    import asyncio

    return await asyncio.to_thread(
        call, uuid, text, state=state, timeout=timeout, machine=machine, channel=channel
    )


@dataclasses.dataclass(frozen=True)
class Instance:
    """An instance of a service on the fabric."""

    id: str
    uuid: str
    name: str
    description: str
    version: str
    host: str
    pid: int
    #: "MACHINE/N" each; empty: all.
    channels: list[str]
    delivery: str
    completion: str
    concurrency: int
    draining: bool
    #: The subject of its certificate; empty on a fabric without trust.
    certificate: str
    running: int
    waiting: int
    answered: int
    failed: int
    #: Mean time in handlers, in seconds.
    mean: float


def services() -> list[Instance]:
    """Every instance on the fabric. Listens 0.7 to 5 s."""
    library = _library.library()
    handle = ctypes.c_void_p()
    _library.check(library.list(_participant().handle, ctypes.byref(handle)))
    try:
        return [_instance(library.instances_at(handle, i).contents) for i in range(library.instances_count(handle))]
    finally:
        library.instances_free(handle)


def _instance(of: _library.Instance) -> Instance:
    return _library.filled(
        Instance,
        of,
        channels=_library.utf8(of.channels).split(),
        delivery="at-most-once" if of.delivery else "at-least-once",
        completion="response" if of.completion else "response-state",
        concurrency=of.concurrent_calls,
    )


@dataclasses.dataclass(frozen=True)
class Event:
    """A step of a call, or an alarm of a process."""

    #: "seen", "unserved", "dispatched", "interim", "replied", "written", "withdrawn", "lost", "late", "refused" or
    #: "held" of a call; "alarm" or "alarm over".
    kind: str
    #: Seconds since 1970-01-01T00:00:00Z, by the clock of the host that reports it.
    time: float
    #: Events lost before this one.
    lost: int
    machine: str
    channel: int
    call_id: str
    attempt: int
    uuid: str
    #: Text of the request or of the response.
    text: str
    state: int
    replayed: bool
    #: Id of the instance that has the call, or of the process that reports the alarm; may be empty.
    instance: str
    #: Why; of an alarm what is the matter.
    detail: str
    #: Of an alarm: "fine", "warning" or "problem", its kind, what it is about, what to do, and the process.
    level: str
    alarm: str
    subject: str
    remedy: str
    process: str
    host: str
    pid: int


class Watch(Iterator[Event]):
    """What `watch()` returns: an iterator of events, and a context manager that ends it."""

    def __init__(self, what: int, timeout: float | None) -> None:
        self._handle: ctypes.c_void_p | None = None
        self._library = _library.library()
        self._end = None if timeout is None else time.monotonic() + timeout
        options = _library.ObserverOptions(what=what)
        handle = ctypes.c_void_p()
        _library.check(
            self._library.observer_open(_participant().handle, ctypes.byref(options), ctypes.byref(handle))
        )
        self._handle = handle

    def __next__(self) -> Event:
        while self._handle is not None and (self._end is None or time.monotonic() < self._end):
            rest = _SLICE if self._end is None else min(_SLICE, max(0.0, self._end - time.monotonic()))
            event = ctypes.POINTER(_library.Event)()
            code = self._library.observe(self._handle, int(rest * 1000), ctypes.byref(event))
            if _library.check(code) == _library.OK:
                return _event(event.contents)
        raise StopIteration

    def close(self) -> None:
        """Ends the observation."""
        handle, self._handle = self._handle, None
        if handle is not None:
            self._library.observer_free(handle)

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()


def watch(*, calls: bool = True, alarms: bool = True, timeout: float | None = None) -> Watch:
    """Calls and alarms of the fabric as they happen; ends after `timeout` seconds, or never."""
    what = (_library.OBSERVE_CALLS if calls else 0) | (_library.OBSERVE_ALARMS if alarms else 0)
    if not what:
        raise _errors.InvalidArgument("neither calls nor alarms are to be watched")
    return Watch(what, timeout)


def _event(of: _library.Event) -> Event:
    return _library.filled(Event, of, uuid=_text.decode(of.uuid), text=_text.decode(of.text))
