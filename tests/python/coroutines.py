"""A service for tests whose handler is a coroutine; ten calls at a time, in one thread."""

import asyncio

import millrace

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
    if call.text == "raise":
        raise RuntimeError("Größe fehlt")
    return "alone"


millrace.run()
