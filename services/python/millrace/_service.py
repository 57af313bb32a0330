"""Services: functions with a UUID. Their results and exceptions become responses."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import logging
import traceback
from collections.abc import Awaitable, Callable
from typing import Any, Literal, Union

from millrace import _call, _errors, _text

Result = Union[str, bytes, "tuple[str | bytes, int]", _call.Response]
Handler = Callable[[_call.Call], Union[Result, Awaitable[Result]]]

log = logging.getLogger("millrace")


@dataclasses.dataclass
class Service:
    """A handler and its options: the result of `@millrace.service`. Calling it calls the handler."""

    handler: Handler
    #: What NC programs write to V.G.SERVICE.UUID; upper and lower case are the same.
    uuid: str
    name: str
    description: str = ""
    version: str = ""
    #: "MACHINE/N" each; either part may be "*". Empty: all.
    channels: list[str] = dataclasses.field(default_factory=list)
    #: "at-least-once" or "at-most-once".
    delivery: str = "at-least-once"
    #: "response-state" or "response".
    completion: str = "response-state"
    #: Calls that may be under way at the same time, 1 to 256.
    concurrency: int = 1
    #: Threads that run a handler that is no `async def`; None: as many as `concurrency`.
    threads: int | None = None
    #: State of a response that stands for an error.
    error_state: int = 500

    def __post_init__(self) -> None:
        functools.update_wrapper(self, self.handler)

    def __call__(self, call: _call.Call) -> Any:
        return self.handler(call)

    @property
    def is_async(self) -> bool:
        """The handler is an `async def`: all of them run in one event loop."""
        return inspect.iscoroutinefunction(self.handler)


#: The services of this process in the order of their `@millrace.service`.
registered: list[Service] = []


def service(
    uuid: str,
    *,
    name: str | None = None,
    description: str | None = None,
    version: str = "",
    channels: list[str] | None = None,
    delivery: Literal["at-least-once", "at-most-once"] = "at-least-once",
    completion: Literal["response-state", "response"] = "response-state",
    concurrency: int = 1,
    threads: int | None = None,
    error_state: int = 500,
) -> Callable[[Handler], Service]:
    """Makes a service of a function or an `async def` that takes a `millrace.Call`.

    The function returns str, bytes, (text, state) or millrace.Response; an exception becomes an error response. `name`
    is that of the function unless given, `description` the first line of its docstring. The arguments are those of
    `millrace.Service`.
    """

    def register(handler: Handler) -> Service:
        first_line = (inspect.getdoc(handler) or "").partition("\n")[0]
        made = Service(
            handler,
            uuid,
            name=name or str(getattr(handler, "__name__", "service")),
            description=first_line if description is None else description,
            version=version,
            channels=list(channels or []),
            delivery=delivery,
            completion=completion,
            concurrency=concurrency,
            threads=threads,
            error_state=error_state,
        )
        registered.append(made)
        return made

    return register


def _words(make: Callable[[], str], otherwise: str) -> str:
    """What `make` returns, printable and bounded; `otherwise` if it raises or returns nothing."""
    try:
        text = make()
    except BaseException:  # A handler's __str__ may raise anything.
        return f"{otherwise} (its text cannot be made)"
    return _text.printable(text) or otherwise


def reason_of(error: BaseException) -> str:
    """The text of an error response for an exception: its text, or its name if it has none."""
    if isinstance(error, SystemExit):
        value = error.code
        code = "" if value is None else _words(lambda: repr(value), "?")
        return f"the handler called sys.exit({code}); the service goes on"
    return _words(lambda: str(error), type(error).__name__)


def _traceback_of(error: BaseException) -> str:
    """Where it was raised, and what caused it; without the texts, which may have any length."""
    lines: list[str] = []
    cause: BaseException | None = error
    while cause is not None and len(lines) < 50:
        lines += traceback.format_tb(cause.__traceback__, limit=-10)
        lines.append(f"{type(cause).__name__}: {reason_of(cause)}\n")
        cause = cause.__cause__ or (None if cause.__suppress_context__ else cause.__context__)
        if cause is not None:
            lines.append("after this exception:\n")
    return "".join(lines).rstrip()


def _finish(call: _call.Call, port: _call.Port, result: object) -> None:
    """Ends a call with what its handler returned."""
    if result is _call.LATER:
        return
    try:
        text, state = _call.response_of(result)
    except Exception as error:  # A handler may return any object.
        reason = f"the response cannot be sent: {reason_of(error)}"
        log.error("call %s: %s", call.id, reason)
        port.fail(_text.encode_reason(reason))
        return
    try:
        port.answer(text, state)
    except _errors.InvalidArgument:
        # The library has answered with the reason and logged it.
        return


def _finish_with(call: _call.Call, port: _call.Port, error: BaseException) -> None:
    """Ends a call with what its handler raised."""
    if isinstance(error, _errors.Decline):
        port.decline(_text.encode_reason(_words(lambda: str(error), "declined")))
        return
    reason = reason_of(error)
    log.error("call %s: %s\n%s", call.id, reason, _traceback_of(error))
    port.fail(_text.encode_reason(reason))


def _contained(call: _call.Call, end: Callable[[], None]) -> None:
    """Ends a call, unless its handler has ended it before or it belongs to the parent process."""
    try:
        end()
    except _errors.Ended:
        log.warning("call %s was ended before; what its handler returned is dropped", call.id)
    except _errors.Error as error:
        log.error("call %s: %s", call.id, error)


def run(service: Service, call: _call.Call, port: _call.Port) -> None:
    """Runs a handler for a call and ends the call. Raises nothing: no call ends a service."""
    try:
        result = service.handler(call)
    except BaseException as error:  # Also SystemExit and KeyboardInterrupt.
        _contained(call, functools.partial(_finish_with, call, port, error))
    else:
        _contained(call, functools.partial(_finish, call, port, result))


async def run_async(service: Service, call: _call.Call, port: _call.Port) -> None:
    """The same for an `async def`."""
    import asyncio

    try:
        made = service.handler(call)
        result = await made if inspect.isawaitable(made) else made
    except asyncio.CancelledError:
        # The NC program has withdrawn its request, or the process ends.
        _contained(call, functools.partial(port.fail, b"the call was cancelled"))
    except BaseException as error:
        _contained(call, functools.partial(_finish_with, call, port, error))
    else:
        _contained(call, functools.partial(_finish, call, port, result))
