"""libmillrace.so.1 through ctypes: services/c/millrace.h, member for member."""

from __future__ import annotations

import ctypes
import functools
import os
from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_char_p,
    c_int32,
    c_int64,
    c_size_t,
    c_uint16,
    c_uint32,
    c_uint64,
    c_void_p,
)
from typing import Any

from millrace import _errors

OK, INVALID, NOT_CONNECTED, NOTHING, CLOSED, ENDED, UNSERVED, NO_RESPONSE, INTERIM, FORKED, FAILED = range(11)

FOREVER = 0xFFFFFFFF
LOG_ERROR, LOG_WARN, LOG_INFO, LOG_DEBUG, LOG_TRACE = range(1, 6)
OBSERVE_CALLS, OBSERVE_ALARMS = 1, 2

LogFunction = CFUNCTYPE(None, c_int32, c_char_p, c_void_p)


class ParticipantOptions(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("fabric_config", c_char_p),
        ("use_domain", c_int32),
        ("domain", c_uint32),
        ("fabric", c_char_p),
        ("name", c_char_p),
        ("discovers", c_int32),
        ("log_level", c_int32),
        ("log", LogFunction),
        ("log_context", c_void_p),
    ]


class ServiceOptions(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("uuid", c_char_p),
        ("name", c_char_p),
        ("description", c_char_p),
        ("version", c_char_p),
        ("channels", c_char_p),
        ("delivery", c_int32),
        ("completion", c_int32),
        ("concurrent_calls", c_uint32),
        ("error_state", c_uint32),
        ("handler", c_void_p),
        ("handler_context", c_void_p),
        ("threads", c_uint32),
    ]


class CallInfo(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("text", c_char_p),
        ("text_length", c_size_t),
        ("state", c_uint32),
        ("uuid", c_char_p),
        ("machine", c_char_p),
        ("channel", c_uint16),
        ("attempt", c_uint32),
        ("call_id", c_char_p),
        ("deadline_ns", c_int64),
        ("replayed", c_int32),
    ]


class RequestOptions(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("uuid", c_char_p),
        ("text", c_char_p),
        ("text_length", c_size_t),
        ("state", c_uint32),
        ("machine", c_char_p),
        ("channel", c_uint16),
        ("timeout_ms", c_uint32),
    ]


class Response(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("text", c_char_p),
        ("text_length", c_size_t),
        ("state", c_uint32),
        ("result", c_int32),
        ("instance", c_char_p),
        ("call_id", c_char_p),
        ("duration_ns", c_int64),
    ]


class Instance(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("id", c_char_p),
        ("uuid", c_char_p),
        ("name", c_char_p),
        ("description", c_char_p),
        ("version", c_char_p),
        ("host", c_char_p),
        ("pid", c_uint32),
        ("channels", c_char_p),
        ("delivery", c_int32),
        ("completion", c_int32),
        ("concurrent_calls", c_uint32),
        ("draining", c_int32),
        ("certificate", c_char_p),
        ("running", c_uint32),
        ("waiting", c_uint32),
        ("answered", c_uint64),
        ("failed", c_uint64),
        ("mean_ns", c_int64),
    ]


class ObserverOptions(Structure):
    _fields_ = [("size", c_size_t), ("what", c_uint32), ("capacity", c_uint32)]


class Event(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("kind", c_char_p),
        ("time_ns", c_int64),
        ("lost", c_uint64),
        ("machine", c_char_p),
        ("channel", c_uint16),
        ("call_id", c_char_p),
        ("attempt", c_uint32),
        ("uuid", c_char_p),
        ("text", c_char_p),
        ("text_length", c_size_t),
        ("state", c_uint32),
        ("replayed", c_int32),
        ("instance", c_char_p),
        ("detail", c_char_p),
        ("level", c_char_p),
        ("alarm", c_char_p),
        ("subject", c_char_p),
        ("remedy", c_char_p),
        ("process", c_char_p),
        ("host", c_char_p),
        ("pid", c_uint32),
    ]


#: In place of a duration that a recording does not show.
UNKNOWN = -(2**63)

#: The durations in RecordedCall, without "_ns".
HOPS = ("dispatch", "to_service", "queue", "work", "to_gateway", "write_back", "total")


class RecordedCall(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("call_id", c_char_p),
        ("machine", c_char_p),
        ("channel", c_uint16),
        ("uuid", c_char_p),
        ("outcome", c_char_p),
        ("attempt", c_uint32),
        ("instance", c_char_p),
        ("name", c_char_p),
        ("host", c_char_p),
        ("request", c_char_p),
        ("request_length", c_size_t),
        ("request_state", c_uint32),
        ("response", c_char_p),
        ("response_length", c_size_t),
        ("response_state", c_uint32),
        ("detail", c_char_p),
        ("replayed", c_int32),
        ("seen_ns", c_int64),
        ("ended_ns", c_int64),
        *((hop + "_ns", c_int64) for hop in HOPS),
        ("steps", c_size_t),
    ]


class Step(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("name", c_char_p),
        ("time_ns", c_int64),
        ("by_service", c_int32),
        ("attempt", c_uint32),
        ("instance", c_char_p),
        ("text", c_char_p),
        ("text_length", c_size_t),
        ("state", c_uint32),
        ("detail", c_char_p),
    ]


# Name, result, arguments. Handles are void*.
_FUNCTIONS: list[tuple[str, Any, list[Any]]] = [
    ("error", c_char_p, []),
    ("version", c_char_p, []),
    ("join", c_int32, [POINTER(ParticipantOptions), POINTER(c_void_p)]),
    ("participant_free", None, [c_void_p]),
    ("domain", c_uint32, [c_void_p]),
    ("is_expired", c_int32, [c_void_p]),
    ("notify_supervisor", None, [c_char_p]),
    ("serve", c_int32, [c_void_p, POINTER(ServiceOptions), POINTER(c_void_p)]),
    ("service_uuid", c_char_p, [c_void_p]),
    ("service_instance", c_char_p, [c_void_p]),
    ("next", c_int32, [c_void_p, c_uint32, POINTER(c_void_p)]),
    ("drain", c_int32, [c_void_p]),
    ("leave", c_int32, [c_void_p]),
    ("service_free", None, [c_void_p]),
    ("call_get", POINTER(CallInfo), [c_void_p]),
    ("call_cancelled", c_int32, [c_void_p]),
    ("call_interim", c_int32, [c_void_p, c_char_p, c_size_t, c_uint32]),
    ("call_answer", c_int32, [c_void_p, c_char_p, c_size_t, c_uint32]),
    ("call_fail", c_int32, [c_void_p, c_char_p, c_size_t]),
    ("call_decline", c_int32, [c_void_p, c_char_p, c_size_t]),
    ("call_free", None, [c_void_p]),
    ("request_send", c_int32, [c_void_p, POINTER(RequestOptions), POINTER(c_void_p)]),
    ("request_wait", c_int32, [c_void_p, c_uint32, POINTER(POINTER(Response))]),
    ("request_free", None, [c_void_p]),
    ("list", c_int32, [c_void_p, POINTER(c_void_p)]),
    ("instances_count", c_size_t, [c_void_p]),
    ("instances_at", POINTER(Instance), [c_void_p, c_size_t]),
    ("instances_free", None, [c_void_p]),
    ("observer_open", c_int32, [c_void_p, POINTER(ObserverOptions), POINTER(c_void_p)]),
    ("observe", c_int32, [c_void_p, c_uint32, POINTER(POINTER(Event))]),
    ("observer_free", None, [c_void_p]),
    ("recording_open", c_int32, [c_char_p, POINTER(c_void_p)]),
    ("recording_next", c_int32, [c_void_p, POINTER(POINTER(RecordedCall))]),
    ("recording_step", POINTER(Step), [c_void_p, c_size_t]),
    ("recording_problem", c_char_p, [c_void_p, c_size_t]),
    ("recording_free", None, [c_void_p]),
]

_BRIEF = {"call_get", "call_cancelled", "error"}


class Library:
    """The functions of millrace.h without their prefix."""

    def __init__(self, path: str) -> None:
        waiting = ctypes.CDLL(path)
        brief = ctypes.PyDLL(path)
        for name, result, arguments in _FUNCTIONS:
            # Functions that return at once keep the interpreter's lock: releasing it lets another thread run first.
            function = getattr(brief if name in _BRIEF else waiting, "millrace_" + name)
            function.restype = result
            function.argtypes = arguments
            setattr(self, name, function)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


@functools.cache
def library() -> Library:
    """Loads the library at its first use: the package and its testing module can be imported without it.

    MILLRACE_LIBRARY names another file than the host's libmillrace.so.1.
    """
    path = os.environ.get("MILLRACE_LIBRARY") or "libmillrace.so.1"
    try:
        return Library(path)
    except OSError as error:
        raise _errors.Error(
            f"cannot load {path} (package libmillrace1; MILLRACE_LIBRARY names another file): {error}"
        ) from None


_EXCEPTIONS: dict[int, type[_errors.Error]] = {
    INVALID: _errors.InvalidArgument,
    NOT_CONNECTED: _errors.NotConnected,
    CLOSED: _errors.Closed,
    ENDED: _errors.Ended,
    UNSERVED: _errors.Unserved,
    NO_RESPONSE: _errors.NoResponse,
    FORKED: _errors.Closed,
}


def utf8(text: bytes | None) -> str:
    """A text of the library other than the text of a call."""
    return (text or b"").decode("utf-8", "replace")


def check(code: int) -> int:
    """Returns the code, or raises the exception of an error with the text of the library."""
    if code in (OK, NOTHING, INTERIM):
        return code
    raise _EXCEPTIONS.get(code, _errors.Error)(utf8(library().error()))


def option(text: str | None) -> bytes | None:
    """A text option; None stays NULL."""
    if text is None:
        return None
    if "\0" in text:
        raise _errors.InvalidArgument(f"{text!r} contains a NUL character")
    return text.encode("utf-8")

