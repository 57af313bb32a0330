"""This process on a fabric."""

from __future__ import annotations

import ctypes
import logging
import os
from typing import Any

from millrace import _errors, _library

_LEVELS = {
    _library.LOG_ERROR: logging.ERROR,
    _library.LOG_WARN: logging.WARNING,
    _library.LOG_INFO: logging.INFO,
    _library.LOG_DEBUG: logging.DEBUG,
    _library.LOG_TRACE: 5,
}
_WORDS = {"error": 1, "warn": 2, "info": 3, "debug": 4, "trace": 5}

log = logging.getLogger("millrace")


def _write_log(level: int, text: bytes, _context: object) -> None:
    log.log(_LEVELS.get(level, logging.INFO), "%s", _library.utf8(text))


# Never freed: the library may call it as long as any handle exists.
_LOG = _library.LogFunction(_write_log)
logging.addLevelName(5, "TRACE")


class Participant:
    """Joins the fabric that the arguments, the environment and /etc/millrace/fabric.textproto describe."""

    def __init__(
        self,
        *,
        fabric_config: str | os.PathLike[str] | None = None,
        domain: int | None = None,
        fabric: str | None = None,
        name: str | None = None,
        discovers: bool = False,
        log_level: str | None = None,
    ) -> None:
        #: Whether this process discovers the others. `call()`, `services()` and `watch()` need it.
        self.discovers = discovers
        self._process = os.getpid()
        options = _library.ParticipantOptions(
            fabric_config=None if fabric_config is None else os.fsencode(fabric_config),
            use_domain=0 if domain is None else 1,
            domain=0 if domain is None else domain,
            fabric=_library.option(fabric),
            name=_library.option(name),
            discovers=1 if discovers else 0,
            log_level=_WORDS[log_level] if log_level else 0,
            log=_LOG,
        )
        handle = ctypes.c_void_p()
        library = _library.library()
        _library.check(library.join(ctypes.byref(options), ctypes.byref(handle)))
        self._handle: ctypes.c_void_p | None = handle

    @property
    def handle(self) -> Any:
        """For functions of the library. Raises Closed."""
        if self._handle is None:
            raise _errors.Closed("the participant has left its fabric")
        return self._handle

    @property
    def domain(self) -> int:
        """The DDS domain that was joined."""
        return int(_library.library().domain(self.handle))

    @property
    def expired(self) -> bool:
        """The certificate of this process has expired or is revoked."""
        return bool(_library.library().is_expired(self.handle))

    def close(self) -> None:
        """Leaves the fabric when the last handle made with it is closed. Does nothing in a forked child."""
        if self._handle is not None and os.getpid() == self._process:
            _library.library().participant_free(self._handle)
        self._handle = None
