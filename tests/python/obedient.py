"""A service for tests: it follows the instruction in its request.

    obedient.py [--discovers] [--own FLAG] and the flags of every service
"""

import os
import signal
import sys
import threading
import time

import millrace

UUID = "b0ad0000-0000-4000-8000-000000000001"

go = threading.Event()
together = threading.Barrier(4)


def say(what):
    print(what, flush=True)


@millrace.service(UUID, name="obedient", version="1.2", concurrency=6)
def obey(call):
    """Follows the instruction in its request."""
    word, _, rest = call.text.partition(" ")
    if word == "raise":
        raise ValueError(rest)
    if word == "exit":
        sys.exit(3)
    if word == "long":
        return "x" * 128
    if word == "state":
        return rest, int(rest)
    if word == "foreign":
        return chr(0x4E2D)
    if word == "nothing":
        return None
    if word == "interim":
        call.interim("half way", 50)
        return "all the way"
    if word == "hang":
        say("hanging")
        threading.Event().wait()
    if word == "spin":
        call.interim("spinning", 50)
        while True:
            pass
    if word == "hold":
        say("holding")
        go.wait(60)
        return "released"
    if word == "release":
        go.set()
        return "done"
    if word == "cancel":
        call.interim("waiting", 50)
        while not call.cancelled:
            time.sleep(0.001)
        say("cancelled")
        return "not read"
    if word == "decline" and call.attempt == 1:
        raise millrace.Decline("not the first time")
    if word == "later":
        threading.Thread(target=lambda: call.answer(rest, 4)).start()
        return millrace.LATER
    if word == "together":
        together.wait(60)
        return str(threading.active_count() > 0)
    if word == "fork":
        child = os.fork()
        if child == 0:
            return "from the child"
        _, status = os.waitpid(child, 0)
        return f"the child ended with {os.waitstatus_to_exitcode(status)}"
    if word == "call":
        return "it said: " + str(millrace.call(rest, "hello"))
    if word == "who":
        machine = call.machine.partition(".")[0]
        return f"{machine}/{call.channel} {call.state} {call.attempt} {call.deadline} {call.replayed}"
    return f"{call.text}, attempt {call.attempt}", call.state


def main():
    signal.signal(signal.SIGUSR1, lambda *_: go.set())
    parser = millrace.argument_parser()
    parser.add_argument("--discovers", action="store_true")
    arguments = parser.parse_args()
    millrace.run(arguments, discovers=arguments.discovers)


if __name__ == "__main__":
    main()
