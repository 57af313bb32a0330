"""Ends its main thread at SIGUSR1, while handlers run and threads wait for calls; for tests.

    leaves.py DOMAIN return|exit|raise
    leaves.py DOMAIN late                   the interpreter then shuts down until another SIGUSR1
"""

import atexit
import signal
import sys

import millrace

signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})


@millrace.service("b0ad0000-0000-4000-8000-000000000004", concurrency=3)
def leaves(call):
    if call.text == "late":
        return "late"
    call.interim("entered", 50)
    while True:
        call.cancelled


@millrace.service("b0ad0000-0000-4000-8000-000000000005")
async def idle(call):
    return call.text


def wait_at_exit():
    print("leaving", flush=True)
    signal.sigwait({signal.SIGUSR1})


server = millrace.Server(leaves, idle, domain=int(sys.argv[1]))
print("ready", flush=True)
signal.sigwait({signal.SIGUSR1})
if sys.argv[2] == "late":
    atexit.register(wait_at_exit)
if sys.argv[2] == "exit":
    sys.exit(7)
if sys.argv[2] == "raise":
    raise RuntimeError("the program is over")
