"""Tests services without a fabric, in milliseconds. Needs neither a gateway nor libmillrace.

A handler for one call:

    from millrace import testing
    from length import length

    def test_counts_characters():
        assert testing.call(length, "hello").text == "5"

    def test_stops_when_cancelled():
        call = testing.FakeCall("hello")
        call.cancel()
        length(call)

Calls that are repeated, withdrawn and lost:

    def test_a_killed_instance_loses_no_call():
        with testing.Loopback(slow, instances=2) as loopback:
            pending = loopback.send(slow, "3")
            loopback.kill(pending.instance)
            assert pending.wait().text == "3"
            assert pending.attempt == 2
"""

from __future__ import annotations

import datetime
import itertools
import threading
from collections.abc import Sequence
from typing import Any

from millrace import _call, _errors, _service, _text

#: Seconds that `Pending.wait()` waits by default.
PATIENCE = 10.0


def _error_text(reason: bytes) -> bytes:
    """As the service library forms it: what does not fit is replaced by "..."."""
    text = b"ERROR: " + reason.partition(b"\0")[0]
    return text if len(text) <= _text.MAX_TEXT else text[: _text.MAX_TEXT - 3] + b"..."


def _refusal(text: bytes, state: int, completion: str) -> str:
    """Why the service library does not send a response; empty if it does."""
    if completion == "response-state" and state == 0:
        return "the service answered with state 0, which would not release the program"
    if completion == "response" and not text:
        return "the service answered without a text, which would not release the program"
    return _text_refusal(text)


def _text_refusal(text: bytes) -> str:
    if len(text) > _text.MAX_TEXT:
        return f"the service's answer has {len(text)} bytes, at most {_text.MAX_TEXT} fit"
    return "the service's answer contains a NUL byte" if b"\0" in text else ""


class _Port:
    """In place of the library: keeps the responses to a call."""

    def __init__(self, completion: str, error_state: int) -> None:
        self._completion = completion
        self._error_state = error_state
        self._lock = threading.Lock()
        self.stop = threading.Event()
        self.ended = threading.Event()
        self.interims: list[_call.Response] = []
        self.response: _call.Response | None = None
        self.declined: str | None = None

    def cancelled(self) -> bool:
        return self.stop.is_set()

    def interim(self, text: bytes, state: int) -> None:
        if refusal := _text_refusal(text):
            raise _errors.InvalidArgument(refusal)
        if not self.ended.is_set() and not self.cancelled() and self._completion == "response-state":
            self.interims.append(_call.Response(_text.decode(text), state))

    def _end(self, response: _call.Response | None, declined: str | None = None) -> None:
        with self._lock:
            if self.ended.is_set():
                raise _errors.Ended("the call was answered or declined before")
            self.response, self.declined = response, declined
            self.ended.set()

    def answer(self, text: bytes, state: int) -> None:
        refusal = _refusal(text, state, self._completion)
        if refusal:
            self._end(self._error(refusal.encode(), "refused"))
            raise _errors.InvalidArgument(refusal)
        self._end(_call.Response(_text.decode(text), state))

    def fail(self, reason: bytes) -> None:
        self._end(self._error(reason, "failed"))

    def decline(self, reason: bytes) -> None:
        self._end(None, _text.decode(reason))

    def _error(self, reason: bytes, result: str) -> _call.Response:
        return _call.Response(_text.decode(_error_text(reason)), self._error_state, result)


class FakeCall(_call.Call):
    """A call for tests: its arguments are the members of `millrace.Call`."""

    __slots__ = ("_fake",)

    def __init__(
        self,
        text: str | bytes = "",
        state: int = 1,
        *,
        uuid: str = "00000000-0000-4000-8000-000000000000",
        machine: str = "cnc",
        channel: int = 1,
        id: str = "7e57-1",
        attempt: int = 1,
        deadline: datetime.datetime | None = None,
        replayed: bool = False,
        completion: str = "response-state",
        error_state: int = 500,
    ) -> None:
        self._fake = _Port(completion, error_state)
        data = _text.encode(text)
        if len(data) > _text.MAX_TEXT:
            raise _errors.InvalidArgument(f"the request has {len(data)} bytes; a controller's string holds 127")
        super().__init__(
            self._fake,
            data=data,
            state=state,
            uuid=uuid,
            machine=machine,
            channel=channel,
            id=id,
            attempt=attempt,
            deadline=deadline,
            replayed=replayed,
        )

    def cancel(self) -> None:
        """The NC program withdraws its request."""
        self._fake.stop.set()

    @property
    def interims(self) -> list[_call.Response]:
        """Interim responses so far."""
        return self._fake.interims

    @property
    def response(self) -> _call.Response | None:
        """The final response, if there is one."""
        return self._fake.response

    @property
    def declined(self) -> str | None:
        """Why the handler declined the call, or None."""
        return self._fake.declined

    def wait(self, timeout: float = PATIENCE) -> _call.Response:
        """The final response, for a handler that answers later.

        Raises NoResponse after `timeout` seconds, and Decline.
        """
        if not self._fake.ended.wait(timeout):
            raise _errors.NoResponse(f"no response within {timeout:g} s")
        if self._fake.response is None:
            raise _errors.Decline(self._fake.declined or "")
        return self._fake.response


def _run(service: _service.Service, call: FakeCall) -> None:
    if not service.is_async:
        _service.run(service, call, call._fake)
        return
    import asyncio

    async def watched() -> None:
        task = asyncio.ensure_future(_service.run_async(service, call, call._fake))
        while not task.done():
            await asyncio.wait({task}, timeout=0.01)
            if call.cancelled:
                task.cancel()

    asyncio.run(watched())


def _service_of(handler: _service.Service | _service.Handler) -> _service.Service:
    if isinstance(handler, _service.Service):
        return handler
    return _service.Service(handler, FakeCall().uuid, getattr(handler, "__name__", "handler"))


def call(
    handler: _service.Service | _service.Handler, text: str | bytes = "", state: int = 1, **members: Any
) -> _call.Response:
    """Runs a handler for one call as a service does, and returns the response that the NC program gets.

    `members` are those of `FakeCall`. An exception of the handler becomes an error response. Raises Decline if the
    handler declines.
    """
    service = _service_of(handler)
    of_service: dict[str, Any] = {
        "uuid": service.uuid,
        "completion": service.completion,
        "error_state": service.error_state,
    }
    fake = FakeCall(text, state, **{**of_service, **members})
    _run(service, fake)
    return fake.wait()


class Pending:
    """A call in a `Loopback`."""

    def __init__(self, loopback: Loopback, service: _service.Service, members: dict[str, Any]) -> None:
        self._loopback = loopback
        self.service = service
        self._members = members
        #: The newest attempt as its handler gets it; None while the call waits for an instance.
        self.fake: FakeCall | None = None
        #: 0 before the first dispatch, then 1, 2, …
        self.attempt = 0
        #: Number of the instance that has it, or had it last.
        self.instance = -1
        #: Its instance was lost, and it may run at most once: an operator must decide.
        self.held = False
        self.withdrawn = False
        self.response: _call.Response | None = None
        #: Number of its responses, repeated ones included.
        self.responses = 0

    def withdraw(self) -> None:
        """The NC program withdraws its request; later responses are dropped."""
        self._loopback._withdraw(self)

    def repeat(self) -> None:
        """The gateway publishes the same attempt again, as after a restart."""
        self._loopback._repeat(self)

    def wait(self, timeout: float = PATIENCE) -> _call.Response:
        """The final response. Raises NoResponse after `timeout` seconds, and once the call is held or withdrawn."""
        return self._loopback._wait(self, timeout)


class _Instance:
    def __init__(self, number: int, service: _service.Service) -> None:
        self.number = number
        self.service = service
        self.alive = True
        self.running: set[Pending] = set()
        self.answered: dict[str, _call.Response] = {}


class Loopback:
    """A gateway and instances of services in this process. A context manager.

    Each call goes to one live instance with room, the least busy first; after the death of its instance it is
    dispatched again with a higher attempt, or held if it may run at most once.
    """

    def __init__(self, *services: _service.Service, instances: int = 1) -> None:
        self._changed = threading.Condition()
        self._instances: list[_Instance] = []
        self._waiting: list[Pending] = []
        self._numbers = itertools.count(1)
        for service in services:
            for _ in range(instances):
                self.start(service)

    @property
    def instances(self) -> Sequence[int]:
        """Numbers of the instances that are alive."""
        with self._changed:
            return [one.number for one in self._instances if one.alive]

    def start(self, service: _service.Service) -> int:
        """Starts one more instance and returns its number."""
        with self._changed:
            instance = _Instance(len(self._instances), service)
            self._instances.append(instance)
            self._dispatch()
            return instance.number

    def kill(self, instance: int) -> None:
        """An instance dies. Its handlers go on in this process, but their responses are lost."""
        with self._changed:
            dead = self._instances[instance]
            dead.alive = False
            for pending in list(dead.running):
                dead.running.discard(pending)
                self._lose(pending)
            self._dispatch()

    def send(self, service: _service.Service, text: str | bytes = "", state: int = 1, **members: Any) -> Pending:
        """A call of an NC program; `members` are those of `FakeCall`. Returns at once."""
        members = {
            "id": f"7e57-{next(self._numbers)}",
            "uuid": service.uuid,
            "completion": service.completion,
            "error_state": service.error_state,
            **members,
            "text": text,
            "state": state,
        }
        FakeCall(**members)  # Raises the error of a wrong argument here.
        pending = Pending(self, service, members)
        with self._changed:
            self._waiting.append(pending)
            self._dispatch()
        return pending

    def call(self, service: _service.Service, text: str | bytes = "", state: int = 1, **members: Any) -> _call.Response:
        """As `send()`, and waits for the final response."""
        return self.send(service, text, state, **members).wait()

    def _dispatch(self) -> None:
        for pending in list(self._waiting):
            free = [
                one
                for one in self._instances
                if one.alive and one.service is pending.service and len(one.running) < one.service.concurrency
            ]
            if free:
                self._waiting.remove(pending)
                self._give(pending, min(free, key=lambda one: len(one.running)))

    def _give(self, pending: Pending, instance: _Instance) -> None:
        pending.attempt += 1
        pending.instance = instance.number
        fake = pending.fake = FakeCall(**pending._members, attempt=pending.attempt)
        instance.running.add(pending)

        def work() -> None:
            _run(instance.service, fake)
            fake._fake.ended.wait()
            self._end(pending, instance, fake)

        threading.Thread(target=work, daemon=True, name=f"{instance.service.name} {instance.number}").start()

    def _end(self, pending: Pending, instance: _Instance, fake: FakeCall) -> None:
        with self._changed:
            instance.running.discard(pending)
            if instance.alive and pending.fake is fake and not pending.withdrawn:
                if fake.response is None:
                    self._waiting.append(pending)
                else:
                    instance.answered[fake.id] = fake.response
                    pending.responses += 1
                    pending.response = fake.response
            self._dispatch()
            self._changed.notify_all()

    def _lose(self, pending: Pending) -> None:
        if pending.service.delivery == "at-most-once":
            pending.held = True
            pending.fake = None
            self._changed.notify_all()
        else:
            self._waiting.append(pending)

    def _withdraw(self, pending: Pending) -> None:
        with self._changed:
            pending.withdrawn = True
            if pending in self._waiting:
                self._waiting.remove(pending)
            if pending.fake is not None:
                pending.fake.cancel()
            self._changed.notify_all()

    def _repeat(self, pending: Pending) -> None:
        with self._changed:
            instance = self._instances[pending.instance]
            known = instance.answered.get(pending._members["id"])
            if instance.alive and known is not None:
                pending.responses += 1
                pending.response = _call.Response(known.text, known.state, "repeated" if known.ok else known.result)
                self._changed.notify_all()

    def _wait(self, pending: Pending, timeout: float) -> _call.Response:
        with self._changed:
            self._changed.wait_for(
                lambda: pending.response is not None or pending.held or pending.withdrawn, timeout
            )
            if pending.withdrawn:
                raise _errors.NoResponse("the request was withdrawn")
            if pending.held:
                raise _errors.NoResponse("the call is held: its instance was lost, and it may run at most once")
            if pending.response is None:
                raise _errors.NoResponse(f"no response within {timeout:g} s")
            return pending.response

    def __enter__(self) -> Loopback:
        return self

    def __exit__(self, *_: object) -> None:
        for instance in self.instances:
            self.kill(instance)
