"""libmillrace.so.1 through ctypes: services/c/millrace.h, member for member."""

from __future__ import annotations

import ctypes
import dataclasses
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
from typing import Any, ClassVar, Protocol, TypeVar

from millrace import _errors

OK, INVALID, NOT_CONNECTED, NOTHING, CLOSED, ENDED, UNSERVED, NO_RESPONSE, INTERIM, FORKED, FAILED = range(11)

FOREVER = 0xFFFFFFFF
LOG_ERROR, LOG_WARN, LOG_INFO, LOG_DEBUG, LOG_TRACE = range(1, 6)
OBSERVE_CALLS, OBSERVE_ALARMS = 1, 2

LogFunction = CFUNCTYPE(None, c_int32, c_char_p, c_void_p)

_TYPES: dict[str, Any] = {
    "char*": c_char_p,
    "void*": c_void_p,
    "int32": c_int32,
    "int64": c_int64,
    "uint16": c_uint16,
    "uint32": c_uint32,
    "uint64": c_uint64,
    "size_t": c_size_t,
    "log": LogFunction,
}


def _members(declarations: str) -> list[tuple[str, Any]]:
    """Of a structure, from declarations as in C, after its size."""
    members: list[tuple[str, Any]] = [("size", c_size_t)]
    for declaration in declarations.split(";"):
        kind, names = declaration.split(maxsplit=1)
        members += [(name.strip(), _TYPES[kind]) for name in names.split(",")]
    return members


class _Sized(Structure):
    def __init__(self, **members: Any) -> None:
        super().__init__(size=ctypes.sizeof(self), **members)


class ParticipantOptions(_Sized):
    _fields_ = _members(
        "char* fabric_config; int32 use_domain; uint32 domain; char* fabric, name; "
        "int32 discovers, log_level; log log; void* log_context"
    )


class ServiceOptions(_Sized):
    _fields_ = _members(
        "char* uuid, name, description, version, channels; int32 delivery, completion; "
        "uint32 concurrent_calls, error_state; void* handler, handler_context; uint32 threads"
    )


class CallInfo(_Sized):
    _fields_ = _members(
        "char* text; size_t text_length; uint32 state; char* uuid, machine; uint16 channel; uint32 attempt; "
        "char* call_id; int64 deadline_ns; int32 replayed"
    )


class RequestOptions(_Sized):
    _fields_ = _members(
        "char* uuid, text; size_t text_length; uint32 state; char* machine; uint16 channel; uint32 timeout_ms"
    )


class Response(_Sized):
    _fields_ = _members(
        "char* text; size_t text_length; uint32 state; int32 result; char* instance, call_id; "
        "int64 duration_ns"
    )


class Instance(_Sized):
    _fields_ = _members(
        "char* id, uuid, name, description, version, host; uint32 pid; char* channels; "
        "int32 delivery, completion; uint32 concurrent_calls; int32 draining; char* certificate; "
        "uint32 running, waiting; uint64 answered, failed; int64 mean_ns"
    )


class ObserverOptions(_Sized):
    _fields_ = _members("uint32 what, capacity")


class Event(_Sized):
    _fields_ = _members(
        "char* kind; int64 time_ns; uint64 lost; char* machine; uint16 channel; char* call_id; "
        "uint32 attempt; char* uuid, text; size_t text_length; uint32 state; int32 replayed; "
        "char* instance, detail, level, alarm, subject, remedy, process, host; uint32 pid"
    )


#: In place of a duration that a recording does not show.
UNKNOWN = -(2**63)

#: The durations in RecordedCall, without "_ns".
HOPS = ("dispatch", "to_service", "queue", "work", "to_gateway", "write_back", "total")


class RecordedCall(_Sized):
    _fields_ = _members(
        "char* call_id, machine; uint16 channel; char* uuid, outcome; uint32 attempt; "
        "char* instance, name, host, request; size_t request_length; uint32 request_state; char* response; "
        "size_t response_length; uint32 response_state; char* detail; int32 replayed; "
        "int64 seen_ns, ended_ns, dispatch_ns, to_service_ns, queue_ns, work_ns, to_gateway_ns, write_back_ns, total_ns; "
        "size_t steps"
    )


class Step(_Sized):
    _fields_ = _members(
        "char* name; int64 time_ns; int32 by_service; uint32 attempt; char* instance, text; "
        "size_t text_length; uint32 state; char* detail"
    )


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


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]


_T = TypeVar("_T", bound=_Dataclass)


def filled(kind: type[_T], of: Structure, **others: Any) -> _T:
    """A dataclass from the members of the same names, texts in UTF-8, times in seconds; `others` are as they are."""

    def member(field: dataclasses.Field[Any]) -> Any:
        if field.name in others:
            return others[field.name]
        if hasattr(of, field.name + "_ns"):
            return getattr(of, field.name + "_ns") / 1e9
        value = getattr(of, field.name)
        if str(field.type) == "str":
            return utf8(value)
        return bool(value) if str(field.type) == "bool" else value

    return kind(**{field.name: member(field) for field in dataclasses.fields(kind)})


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

