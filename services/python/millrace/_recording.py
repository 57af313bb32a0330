"""Calls of a recording, to Python, CSV and pandas."""

from __future__ import annotations

import ctypes
import dataclasses
import logging
import os
from collections.abc import Iterator
from typing import Any

from millrace import _library, _text

log = logging.getLogger("millrace")


@dataclasses.dataclass(frozen=True)
class Step:
    """A step of a recorded call."""

    #: "seen by the gateway", "dispatched", "handler started", …
    name: str
    #: Seconds since 1970-01-01T00:00:00Z.
    time: float
    #: By the clock of the service's host, not of the gateway's.
    by_service: bool
    attempt: int
    #: Id of the instance that it concerns; may be empty.
    instance: str
    #: Text and state of the request or of a response.
    text: str
    state: int
    detail: str


@dataclasses.dataclass(frozen=True)
class RecordedCall:
    """A call of an NC program in a recording."""

    call_id: str
    machine: str
    channel: int
    uuid: str
    #: "answered" by a service; "failed": its last attempt did; "settled" by the gateway or an operator; "withdrawn" by
    #: the NC program; "under way" at the end of the recording.
    outcome: str
    #: The last attempt, and the id, name and host of the instance that had it; each may be empty.
    attempt: int
    instance: str
    name: str
    host: str
    #: REQUEST and REQUEST_STATE; RESPONSE and RESPONSE_STATE as they were written.
    request: str
    request_state: int
    response: str
    response_state: int
    #: Why it ended.
    detail: str
    replayed: bool
    #: When the gateway saw it and when it ended, in seconds since 1970-01-01T00:00:00Z; None if that is not recorded.
    seen: float | None
    ended: float | None
    #: Seconds of the attempt whose response was written: "dispatch", "to_service", "queue", "work", "to_gateway",
    #: "write_back" and "total", as far as they are recorded. "to_service" and "to_gateway" compare two clocks.
    hops: dict[str, float]
    steps: list[Step]

    def row(self) -> dict[str, Any]:
        """Its members without the steps, and each hop as a member of its own; None for what is not recorded."""
        members = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        del members["hops"], members["steps"]
        return {**members, **{hop: self.hops.get(hop) for hop in _library.HOPS}}


class Recording:
    """A file of `millrace record`, as an iterable of its calls in the order of their ends.

        slow = [call for call in millrace.Recording("run.mcap") if call.hops.get("work", 0) > 0.1]

    Each iteration reads the file again, and needs little memory. Damaged places are logged as warnings and are in
    `problems`; the rest is read. Raises OSError for a file that cannot be read.
    """

    def __init__(self, file: str | os.PathLike[str]) -> None:
        self.file = os.fspath(file)
        #: The damaged places that the last complete iteration has found.
        self.problems: list[str] = []
        with open(self.file, "rb"):
            pass

    def __iter__(self) -> Iterator[RecordedCall]:
        library = _library.library()
        handle = ctypes.c_void_p()
        _library.check(library.recording_open(os.fsencode(self.file), ctypes.byref(handle)))
        try:
            call = ctypes.POINTER(_library.RecordedCall)()
            while _library.check(library.recording_next(handle, ctypes.byref(call))) == _library.OK:
                yield _call(call.contents, handle)
            self.problems = []
            while problem := library.recording_problem(handle, len(self.problems)):
                self.problems.append(_library.utf8(problem))
                log.warning("%s: %s", self.file, self.problems[-1])
        finally:
            library.recording_free(handle)

    def to_list(self) -> list[RecordedCall]:
        """All calls."""
        return list(self)

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Writes a line for each call, as of `RecordedCall.row()`, in UTF-8. Times are in seconds."""
        import csv

        fields = [one.name for one in dataclasses.fields(RecordedCall) if one.name not in ("hops", "steps")]
        with open(file, "w", encoding="utf-8", newline="") as out:
            writer = csv.DictWriter(out, [*fields, *_library.HOPS])
            writer.writeheader()
            writer.writerows(call.row() for call in self)

    def to_frame(self) -> Any:
        """A pandas DataFrame with a row for each call, as of `RecordedCall.row()`; `seen` and `ended` are times in UTC.

        Raises ImportError without pandas (package python3-pandas).
        """
        import pandas

        frame = pandas.DataFrame([call.row() for call in self])
        for column in ("seen", "ended"):
            if column in frame:
                frame[column] = pandas.to_datetime(frame[column], unit="s", utc=True)
        return frame


def _call(of: _library.RecordedCall, handle: ctypes.c_void_p) -> RecordedCall:
    library = _library.library()
    durations = {hop: getattr(of, hop + "_ns") for hop in _library.HOPS}
    return _library.filled(
        RecordedCall,
        of,
        uuid=_text.decode(of.uuid),
        request=_text.decode(of.request),
        response=_text.decode(of.response),
        seen=of.seen_ns / 1e9 if of.seen_ns else None,
        ended=of.ended_ns / 1e9 if of.ended_ns else None,
        hops={hop: time / 1e9 for hop, time in durations.items() if time != _library.UNKNOWN},
        steps=[_step(library.recording_step(handle, i).contents) for i in range(of.steps)],
    )


def _step(of: _library.Step) -> Step:
    return _library.filled(Step, of, text=_text.decode(of.text))
