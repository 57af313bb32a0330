"""A service for tests whose handler is a coroutine; ten calls at a time, in one thread."""

import asyncio
import sys

import millrace
from millrace._server import _LOOK as LOOK

UUID = "b0ad0000-0000-4000-8000-000000000003"

arrived = 0
all_there = asyncio.Event()


@millrace.service(UUID, concurrency=10)
async def coroutines(call):
    global arrived
    if call.text == "together":
        arrived += 1
        if arrived == 3:
            all_there.set()
        await all_there.wait()
        return "together"
    if call.text == "cancel":
        call.interim("waiting", 50)
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            print("cancelled", flush=True)
            raise
    if call.text == "pause":
        # No call runs when the server looks for cancelled calls, at least once.
        asyncio.get_running_loop().call_later(3 * LOOK, print, "paused")
    if call.text == "raise":
        raise RuntimeError("Größe fehlt")
    return "alone"


sys.stdout.reconfigure(line_buffering=True)
millrace.run()
