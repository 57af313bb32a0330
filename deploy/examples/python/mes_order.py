"""Asks a manufacturing execution system (MES) over HTTP for the next order of a machine, with time-out and retry.

    mes_order.py --url http://mes.example.com/orders

Request: anything; the machine is that of the call. Response: what the MES says, state 1; state 12: the MES refuses
(4xx); state 13: it cannot be reached or fails (5xx) for 8 s. Each request has the header Idempotency-Key with the call
id, so that an MES can recognise a repeated one.
"""

import time
import urllib.error
import urllib.parse
import urllib.request

import millrace

url = ""
#: Seconds for one attempt, for all together, and the first pause between two.
ATTEMPT, TOGETHER, PAUSE = 2.0, 8.0, 0.2


def ask(call, timeout):
    """The text of the MES; raises OSError."""
    request = urllib.request.Request(
        f"{url}?{urllib.parse.urlencode({'machine': call.machine, 'channel': call.channel})}",
        headers={"Idempotency-Key": call.id, "Accept": "text/plain"},
    )
    with urllib.request.urlopen(request, timeout=timeout) as response:
        return response.read(1024).decode("utf-8").strip()


@millrace.service("4b0d6a3e-6f0c-4b5e-9d57-4a1f0f6a1b03", name="mes_order", version="1.0", concurrency=8)
def mes_order(call):
    """Answers with the next order of the calling machine, from the MES."""
    end = time.monotonic() + TOGETHER
    pause, why = PAUSE, ""
    while not call.cancelled and (rest := end - time.monotonic()) > 0:
        try:
            return ask(call, min(ATTEMPT, rest))
        except urllib.error.HTTPError as error:
            if error.code < 500:
                return f"ERROR: the MES refuses: {error.code} {error.reason}"[:127], 12
            why = f"{error.code} {error.reason}"
        except OSError as error:
            why = str(error)
        call.interim("the MES does not answer, trying again", 50)
        time.sleep(min(pause, max(0.0, end - time.monotonic())))
        pause *= 2
    return f"ERROR: the MES cannot be reached: {why}"[:127], 13


def main():
    global url
    parser = millrace.argument_parser([mes_order])
    parser.add_argument("--url", required=True, help="Where the MES answers GET with ?machine=NAME&channel=N")
    arguments = parser.parse_args()
    url = arguments.url
    millrace.run(arguments, mes_order)


if __name__ == "__main__":
    main()
