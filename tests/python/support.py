"""Processes and DDS domains for tests, like tests/support for C++."""

import fcntl
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

#: Longer than any healthy program needs on a busy host; a test that reaches it has failed.
PATIENCE = 30.0

HERE = Path(__file__).resolve().parent
TOP = HERE.parent.parent
#: Programs of the build.
BIN = Path(os.environ.get("MILLRACE_BIN", TOP / "build/release/bin"))

_LAST_DOMAIN = 101


class Domain:
    """A reserved DDS domain, across processes: the lock files are those of tests/support/domain.hpp."""

    def __init__(self):
        for offset in range(_LAST_DOMAIN):
            self.number = (os.getpid() + offset) % _LAST_DOMAIN + 1
            file = Path(tempfile.gettempdir()) / f"millrace-test-domain-{self.number}.lock"
            self._lock = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                os.close(self._lock)
        raise RuntimeError("no free DDS domain for a test: all lock files are held")

    def close(self):
        os.close(self._lock)


class _Stream:
    def __init__(self, pipe):
        self.text = ""
        self.ended = False
        self._changed = threading.Condition()
        self._pipe = pipe
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self):
        with self._pipe:
            for line in self._pipe:
                with self._changed:
                    self.text += line
                    self._changed.notify_all()
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def find(self, pattern):
        end = time.monotonic() + PATIENCE
        with self._changed:
            while True:
                if found := re.search(pattern, self.text, re.MULTILINE):
                    return found
                if self.ended or not self._changed.wait(end - time.monotonic()):
                    return None

    def join(self):
        self._thread.join(PATIENCE)


class Process:
    """A program under test; killed at the end of its `with`."""

    def __init__(self, *command, **environment):
        self._state = tempfile.TemporaryDirectory()
        self._process = subprocess.Popen(
            [str(word) for word in command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={
                **os.environ,
                "MILLRACE_FABRIC_CONFIG": "",
                "PYTHONUNBUFFERED": "1",
                "XDG_STATE_HOME": self._state.name,
                **environment,
            },
        )
        self.pid = self._process.pid
        self.output = _Stream(self._process.stdout)
        self.errors = _Stream(self._process.stderr)

    @classmethod
    def python(cls, script, *arguments, **environment):
        return cls(sys.executable, "-X", "faulthandler", "-W", "error", HERE / script, *arguments, **environment)

    def _await(self, stream, pattern):
        found = stream.find(pattern)
        if found is None:
            raise AssertionError(f"no {pattern!r} in\n{self.output.text}\nnor in\n{self.errors.text}")
        return found

    def await_output(self, pattern):
        return self._await(self.output, pattern)

    def await_error(self, pattern):
        return self._await(self.errors, pattern)

    def signal(self, number=signal.SIGTERM):
        self._process.send_signal(number)

    def wait(self):
        """The exit code; negative for the signal that killed it."""
        try:
            code = self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.signal(signal.SIGABRT)  # a Python that runs with faulthandler says where each thread is
            self._process.wait(PATIENCE)
            self.errors.join()
            raise AssertionError(f"the process does not end\n{self.errors.text}") from None
        self.output.join()
        self.errors.join()
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._process.poll() is None:
            self._process.kill()
        self.wait()
