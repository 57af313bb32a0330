"""Serves: threads that take calls from the library, run handlers and end the calls."""

from __future__ import annotations

import atexit
import ctypes
import datetime
import logging
import os
import threading
import time
import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from millrace import _call, _errors, _library, _service, _text
from millrace._participant import Participant

if TYPE_CHECKING:
    import asyncio

log = logging.getLogger("millrace")

#: Seconds between two checks whether calls of `async def` handlers are cancelled.
_LOOK = 0.05


class NativeCall:
    """A call of the library: the port of a `millrace.Call`."""

    def __init__(self, handle: ctypes.c_void_p) -> None:
        self._library = _library.library()
        self._handle: ctypes.c_void_p | None = handle

    def call(self) -> _call.Call:
        info = self._library.call_get(self._handle).contents
        deadline = info.deadline_ns
        return _call.Call(
            self,
            data=info.text,
            state=info.state,
            uuid=_text.decode(info.uuid),
            machine=_library.utf8(info.machine),
            channel=info.channel,
            id=_library.utf8(info.call_id),
            attempt=info.attempt,
            deadline=datetime.datetime.fromtimestamp(deadline / 1e9, datetime.timezone.utc) if deadline else None,
            replayed=info.replayed != 0,
        )

    def cancelled(self) -> bool:
        return bool(self._library.call_cancelled(self._handle))

    def interim(self, text: bytes, state: int) -> None:
        _library.check(self._library.call_interim(self._handle, text, len(text), state))

    def answer(self, text: bytes, state: int) -> None:
        _library.check(self._library.call_answer(self._handle, text, len(text), state))

    def fail(self, reason: bytes) -> None:
        _library.check(self._library.call_fail(self._handle, reason, len(reason)))

    def decline(self, reason: bytes) -> None:
        _library.check(self._library.call_decline(self._handle, reason, len(reason)))

    def __del__(self) -> None:
        # Nothing else can end the call.
        handle, self._handle = self._handle, None
        if handle is not None:
            self._library.call_free(handle)


class _Running:
    """A service on the fabric, with the threads that run its handler."""

    def __init__(self, participant: Participant, service: _service.Service) -> None:
        self.service = service
        self._library = _library.library()
        self._process = os.getpid()
        self._changed = threading.Condition()
        #: Threads that use the handle now.
        self._inside = 0
        self._closing = False
        #: Calls in handlers, and since when.
        self.calls: dict[str, float] = {}
        options = _library.ServiceOptions(
            uuid=_library.option(service.uuid),
            name=_library.option(service.name),
            description=_library.option(service.description),
            version=_library.option(service.version),
            channels=_library.option(" ".join(service.channels)),
            delivery=_choice(service.delivery, ("at-least-once", "at-most-once"), "delivery"),
            completion=_choice(service.completion, ("response-state", "response"), "completion"),
            concurrent_calls=service.concurrency,
            error_state=service.error_state,
        )
        handle = ctypes.c_void_p()
        _library.check(self._library.serve(participant.handle, ctypes.byref(options), ctypes.byref(handle)))
        self._handle = handle
        self.uuid = _library.utf8(self._library.service_uuid(handle))
        self.instance = _library.utf8(self._library.service_instance(handle))

    def next(self) -> NativeCall | None:
        """Waits for a call; None once the service has drained or left."""
        with self._changed:
            if self._closing:
                return None
            self._inside += 1
        try:
            call = ctypes.c_void_p()
            code = self._library.next(self._handle, _library.FOREVER, ctypes.byref(call))
            return None if code == _library.CLOSED or _library.check(code) != _library.OK else NativeCall(call)
        finally:
            with self._changed:
                self._inside -= 1
                self._changed.notify_all()

    def begin(self, call: _call.Call) -> None:
        self.calls[call.id] = time.monotonic()

    def end(self, call: _call.Call) -> None:
        self.calls.pop(call.id, None)
        if os.getpid() != self._process:
            # A handler that forks and returns in the child, too: the parent answers the call.
            log.error("call %s: the handler has forked, and its child has returned; the child ends here", call.id)
            logging.shutdown()
            os._exit(1)

    def drain(self) -> None:
        with self._changed:
            if not self._closing:
                _library.check(self._library.drain(self._handle))

    def close(self) -> None:
        """Leaves the fabric. Handlers that run go on; their responses are lost."""
        with self._changed:
            if self._closing or os.getpid() != self._process:
                return
            self._closing = True
        self._library.leave(self._handle)
        with self._changed:
            self._changed.wait_for(lambda: self._inside == 0)
        self._library.service_free(self._handle)


def _choice(word: str, words: Sequence[str], what: str) -> int:
    if word not in words:
        raise _errors.InvalidArgument(f"{what} is {word!r}; expected {' or '.join(words)}")
    return words.index(word)


class Server:
    """Serves from the end of its constructor until `close()`; a context manager.

    `services` are those of `@millrace.service`; they share one DDS participant. The other arguments choose the fabric,
    as the flags of every service do; None: the environment and /etc/millrace/fabric.textproto choose. With `discovers`
    handlers may call other services.
    """

    def __init__(
        self,
        *services: _service.Service,
        fabric_config: str | os.PathLike[str] | None = None,
        domain: int | None = None,
        fabric: str | None = None,
        name: str | None = None,
        discovers: bool = False,
        log_level: str | None = None,
    ) -> None:
        self.participant = Participant(
            fabric_config=fabric_config, domain=domain, fabric=fabric, name=name, discovers=discovers, log_level=log_level
        )
        self._running: list[_Running] = []
        self._threads: list[threading.Thread] = []
        self._loop: asyncio.AbstractEventLoop | None = None
        self._loop_thread: threading.Thread | None = None
        _servers.add(self)
        try:
            for service in services:
                self._running.append(_Running(self.participant, service))
            for running in self._running:
                self._start(running)
        except BaseException:
            self.close()
            raise

    @property
    def instances(self) -> list[tuple[_service.Service, str, str]]:
        """Each service with its UUID in canonical form and the id of its instance."""
        return [(running.service, running.uuid, running.instance) for running in self._running]

    def _start(self, running: _Running) -> None:
        service = running.service
        if service.is_async:
            # Here, because it would double the time that importing the package takes.
            import asyncio

            if self._loop is None:
                self._loop = asyncio.new_event_loop()
                self._loop_thread = threading.Thread(target=_run_loop, args=(self._loop,), name="asyncio", daemon=True)
                self._loop_thread.start()
            self._spawn(_Tasks(running, self._loop).work, service.name)
            return
        for _ in range(service.threads or service.concurrency):
            self._spawn(lambda: _work(running), service.name)

    def _spawn(self, work: Any, name: str) -> None:
        # A daemon: a handler that never returns does not keep the process from ending.
        thread = threading.Thread(target=work, name=name, daemon=True)
        thread.start()
        self._threads.append(thread)

    def drain(self) -> None:
        """Takes no new call; calls under way may end. Returns at once."""
        for running in self._running:
            running.drain()

    def wait(self, timeout: float | None = None) -> bool:
        """True when all services have drained; False after `timeout` seconds."""
        end = None if timeout is None else time.monotonic() + timeout
        for thread in self._threads:
            thread.join(None if end is None else max(0.0, end - time.monotonic()))
            if thread.is_alive():
                return False
        return True

    @property
    def calls(self) -> list[tuple[str, str, float]]:
        """Calls in handlers: name of the service, call id, seconds since the handler was called."""
        now = time.monotonic()
        return [
            (running.service.name, call, now - since)
            for running in self._running
            for call, since in running.calls.copy().items()
        ]

    def close(self) -> None:
        """Leaves the fabric at once. Gateways treat calls under way as after a crash."""
        for running in self._running:
            running.close()
        loop, self._loop = self._loop, None
        if loop is not None:
            import asyncio

            ended = asyncio.run_coroutine_threadsafe(_end_tasks(), loop)
            # In this thread if the tasks have ended already: without a wake-up the loop would go on sleeping.
            wake, stop = loop.call_soon_threadsafe, loop.stop
            ended.add_done_callback(lambda _: wake(stop))
            if self._loop_thread is not None and self._loop_thread is not threading.current_thread():
                # A coroutine may ignore its cancellation.
                self._loop_thread.join(1.0)
        self.participant.close()
        _servers.discard(self)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _work(running: _Running) -> None:
    """Runs one call after the other."""
    while (native := running.next()) is not None:
        call = native.call()
        running.begin(call)
        _service.run(running.service, call, native)
        running.end(call)
        del native, call


def _run_loop(loop: asyncio.AbstractEventLoop) -> None:
    import asyncio

    asyncio.set_event_loop(loop)
    try:
        loop.run_forever()
    finally:
        loop.close()


async def _end_tasks() -> None:
    """Cancels the handlers that run."""
    import asyncio

    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)


class _Tasks:
    """The calls of a service whose handler is an `async def`, as tasks of the event loop."""

    def __init__(self, running: _Running, loop: asyncio.AbstractEventLoop) -> None:
        self._running = running
        self._loop = loop
        # Of the loop.
        self._tasks: dict[asyncio.Task[None], _call.Call] = {}
        self._looking = False

    def work(self) -> None:
        while (native := self._running.next()) is not None:
            self._loop.call_soon_threadsafe(self._begin, native)
            del native

    def _begin(self, native: NativeCall) -> None:
        call = native.call()
        self._running.begin(call)
        task = self._loop.create_task(_service.run_async(self._running.service, call, native))
        self._tasks[task] = call
        task.add_done_callback(self._end)
        if not self._looking:
            self._looking = True
            self._loop.call_later(_LOOK, self._look)

    def _end(self, task: asyncio.Task[None]) -> None:
        self._running.end(self._tasks.pop(task))

    def _look(self) -> None:
        for task, call in self._tasks.items():
            if call.cancelled:
                task.cancel()
        self._looking = bool(self._tasks)
        if self._looking:
            self._loop.call_later(_LOOK, self._look)


_servers: weakref.WeakSet[Server] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Before the interpreter ends, so that no thread of the library calls it afterwards."""
    for server in list(_servers):
        server.close()


def any_server() -> Server | None:
    """A server of this process, if there is one."""
    return next(iter(_servers), None)
