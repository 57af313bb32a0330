"""Exceptions."""

from __future__ import annotations


class Error(Exception):
    """Base of the exceptions of this package. Its text says what happened, where, and what was expected."""


class InvalidArgument(Error, ValueError):
    """An argument, an option, a configuration file or a variable of the environment is wrong."""


class TextError(InvalidArgument):
    """A text has a character that CP1252 does not have."""


class NotConnected(Error, ConnectionError):
    """The fabric cannot be joined."""


class Closed(Error):
    """The participant or the service has left its fabric, or this process is a fork of the one that joined."""


class Ended(Error):
    """The call was answered or declined before."""


class Unserved(Error, LookupError):
    """No instance on the fabric serves this UUID for this channel."""


class NoResponse(Error, TimeoutError):
    """No final response came within the time-out."""


class Decline(Exception):
    """Raise it in a handler to give back a call of which nothing was begun.

    The gateway dispatches the call to another instance. Use it when another instance may be able to run the call: the
    gauge of this one is in use, its database is not reachable. The text goes to logs.
    """
