"""A call as its handler gets it, and the response of a handler."""

from __future__ import annotations

import dataclasses
import datetime
from typing import Any, Protocol

from millrace import _text


@dataclasses.dataclass(frozen=True)
class Response:
    """RESPONSE and RESPONSE_STATE for an NC program.

    A handler returns one with `text` and `state`. `millrace.call()` returns one with all members:

    text        str with characters of CP1252, or bytes of CP1252; at most 127 bytes without NUL
    state       1 to 4294967295; 0 only for NC programs that wait for RESPONSE (`completion="response"`)
    result      "ok"; "failed": the handler raised an exception; "repeated": from memory, the service has run the call
                before; "refused": the service gave a response that cannot be sent, and `text` says why
    instance    id of the instance that responded
    call_id     id of the call: the same in logs, events and recordings
    duration    seconds from the dispatch to the final response
    """

    text: str | bytes = ""
    state: int = 1
    result: str = "ok"
    instance: str = ""
    call_id: str = ""
    duration: float = 0.0

    @property
    def ok(self) -> bool:
        """The response is the handler's own: `result` is "ok" or "repeated"."""
        return self.result in ("ok", "repeated")

    def __str__(self) -> str:
        return self.text if isinstance(self.text, str) else _text.decode(self.text)


class _Later:
    def __repr__(self) -> str:
        return "millrace.LATER"


#: A handler returns it to answer later by `call.answer()`, from any thread.
LATER: Any = _Later()


class Port(Protocol):
    """The receiver of a call's responses: the library, or a test bench. Texts are CP1252."""

    def cancelled(self) -> bool: ...
    def interim(self, text: bytes, state: int) -> None: ...
    def answer(self, text: bytes, state: int) -> None: ...
    def fail(self, reason: bytes) -> None: ...
    def decline(self, reason: bytes) -> None: ...


def _state(state: int) -> int:
    if isinstance(state, bool) or not isinstance(state, int):
        raise TypeError(f"a state is an int, not {type(state).__name__}")
    if not 0 <= state <= 0xFFFFFFFF:
        raise ValueError(f"the state {state} does not fit into 32 bits without sign")
    return state


class Call:
    """One call of an NC program. All members may be used from any thread."""

    # With texts, which pydoc shows.
    __slots__ = {
        "_port": "",
        "data": "V.G.SERVICE.REQUEST as bytes of CP1252.",
        "state": "V.G.SERVICE.REQUEST_STATE.",
        "uuid": "V.G.SERVICE.UUID as the NC program wrote it.",
        "machine": "Name of the machine whose NC program calls.",
        "channel": "Number of its channel.",
        "id": "Unique for ever, the same in every attempt.",
        "attempt": "1, 2, …: higher than 1 if another instance may have run the call before.",
        "deadline": "datetime in UTC after which a response has no use; None: no deadline.",
        "replayed": "The call is replayed from a recording; no NC program waits for it.",
    }

    def __init__(
        self,
        port: Port,
        *,
        data: bytes,
        state: int,
        uuid: str,
        machine: str,
        channel: int,
        id: str,
        attempt: int,
        deadline: datetime.datetime | None,
        replayed: bool,
    ) -> None:
        self._port = port
        self.data = data
        self.state = state
        self.uuid = uuid
        self.machine = machine
        self.channel = channel
        self.id = id
        self.attempt = attempt
        self.deadline = deadline
        self.replayed = replayed

    @property
    def text(self) -> str:
        """V.G.SERVICE.REQUEST."""
        return _text.decode(self.data)

    @property
    def cancelled(self) -> bool:
        """The NC program has withdrawn its request: a response has no use.

        Check it in long loops, and return any response. The task of an `async def` handler is cancelled within 50 ms.
        """
        return self._port.cancelled()

    def interim(self, text: str | bytes, state: int) -> None:
        """Writes RESPONSE and RESPONSE_STATE; the NC program goes on waiting, and the call goes on.

        No effect after the end of the call and for NC programs that wait for RESPONSE. Raises InvalidArgument for a
        text of more than 127 bytes, TextError for a character that CP1252 does not have.
        """
        self._port.interim(_text.encode(text), _state(state))

    def answer(self, text: str | bytes, state: int = 1) -> None:
        """Ends a call whose handler has returned `millrace.LATER`.

        Raises Ended if it has ended before, InvalidArgument for a response that cannot be sent (the NC program gets an
        error text instead), TextError for a character that CP1252 does not have.
        """
        data = _text.encode(text)
        self._port.answer(data, _state(state))

    def fail(self, reason: str) -> None:
        """Ends the call as an exception does: with "ERROR: " and the reason, and the error state."""
        self._port.fail(_text.encode_reason(reason))

    def decline(self, reason: str) -> None:
        """Gives back a call of which nothing was begun, as `raise millrace.Decline` does in its handler."""
        self._port.decline(_text.encode_reason(reason))

    def __repr__(self) -> str:
        return f"<millrace.Call {self.id} from {self.machine}/{self.channel}: {self.text!r}, state {self.state}>"


def response_of(result: object) -> tuple[bytes, int]:
    """Text and state of what a handler returned. Raises TypeError, ValueError or TextError."""
    if isinstance(result, Response):
        return _text.encode(result.text), _state(result.state)
    if isinstance(result, tuple):
        if len(result) != 2:
            raise TypeError(f"the handler returned a tuple of {len(result)}; expected (text, state)")
        return _text.encode(result[0]), _state(result[1])
    if isinstance(result, (str, bytes)):
        return _text.encode(result), 1
    raise TypeError(
        f"the handler returned {type(result).__name__}; expected str, bytes, (text, state) or millrace.Response"
    )
