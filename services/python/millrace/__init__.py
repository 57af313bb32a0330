"""Services for NC programs, over DDS.

    import millrace

    @millrace.service("b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e", name="length")
    def length(call):
        return str(len(call.text))

    millrace.run()

An NC program calls the service of a UUID through the Service Interface of its channel; a gateway maps the call to this
process. `millrace.service` makes a service of a function, and `millrace.run` serves it. `millrace.call` calls a
service, `millrace.services` lists instances, `millrace.watch` follows calls and alarms. `millrace.Recording` reads the
calls of a recording. `millrace.testing` tests services without a fabric.

Texts are str with characters of the controller's code page CP1252, or bytes of CP1252; at most 127 bytes. Times are in
seconds. Exceptions are derived from `millrace.Error`.
"""

from millrace._call import LATER, Call, Response
from millrace._client import Event, Instance, Watch, call, call_async, connect, disconnect, services, watch
from millrace._errors import (
    Closed,
    Decline,
    Ended,
    Error,
    InvalidArgument,
    NoResponse,
    NotConnected,
    TextError,
    Unserved,
)
from millrace._program import argument_parser, run
from millrace._recording import RecordedCall, Recording, Step
from millrace._server import Server
from millrace._service import Service, service
from millrace._text import MAX_TEXT

__all__ = [
    "LATER",
    "MAX_TEXT",
    "Call",
    "Closed",
    "Decline",
    "Ended",
    "Error",
    "Event",
    "Instance",
    "InvalidArgument",
    "NoResponse",
    "NotConnected",
    "RecordedCall",
    "Recording",
    "Response",
    "Server",
    "Service",
    "Step",
    "TextError",
    "Unserved",
    "Watch",
    "argument_parser",
    "call",
    "call_async",
    "connect",
    "disconnect",
    "run",
    "service",
    "services",
    "watch",
]
