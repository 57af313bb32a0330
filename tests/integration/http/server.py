#!/usr/bin/env python3
"""A web server for tests, on bare sockets: the path says how it fails.

    server.py FOLDER [--port N] [--cert FILE --key FILE [--client-ca FILE]]

Prints "ready: PORT". Each POST whose body has arrived is a line of FOLDER/posts: its Idempotency-Key, attempt, text and
Authorization. FOLDER/closed has a line for each connection that the client closed while a response was due.

    /echo               the text as JSON
    /plain              the text, as text/plain, with the header Millrace-State: 5
    /plain_once         the same, but the header only in the first response of a connection
    /reset_before       resets the connection before it reads the body
    /reset_after        resets it behind the body
    /half /cut          sends half a response, then resets the connection, or closes it
    /second_dies        answers the first request of a connection, and resets it after the second one's body
    /second_unread      the same, but does not read the second one
    /slow               answers when FOLDER/go exists
    /endless            sends a body without end
    /trickle            sends a byte now and then, without end
    /wrong /500         a body that is not JSON; an error
    /busy /busy_date    503 with Retry-After, in seconds or as a date, until FOLDER/go exists
    /job                202 with Location; the result is there once FOLDER/go exists
    /loop               202 with its own Location, for ever
    /moved              307 to another server
    /early              answers before it reads the body, and closes the connection
    the paths of RAW    what stands there, whether HTTP or not
    GET /health         200, or 500 while FOLDER/sick exists
"""
import argparse
import email.utils
import json
import pathlib
import socket
import ssl
import struct
import threading
import time

parser = argparse.ArgumentParser()
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--port", type=int, default=0)
parser.add_argument("--cert")
parser.add_argument("--key")
parser.add_argument("--client-ca")
options = parser.parse_args()
lock = threading.Lock()


def note(file, *words):
    with lock, open(options.folder / file, "a", encoding="utf-8") as out:
        out.write(" ".join(str(word) for word in words) + "\n")


def has(file):
    return (options.folder / file).exists()


class Reset(Exception):
    pass


class Close(Exception):
    pass


OK = b"HTTP/1.1 200 x\r\n"
CHUNKED = OK + b"Content-Type: text/plain\r\nTransfer-Encoding: chunked\r\n\r\n"
RAW = {
    "/many_headers": OK + 1000 * (b"X: " + 1000 * b"x" + b"\r\n") + b"Content-Length: 0\r\n\r\n",
    "/long_header": OK + b"X: " + 1000000 * b"x" + b"\r\nContent-Length: 0\r\n\r\n",
    "/no_body": OK + b"Content-Length: 0\r\n\r\n",
    "/short_length": OK + b'Content-Type: application/json\r\nContent-Length: 5\r\n\r\n{"text": "4"}',
    "/long_length": OK + b"Content-Type: text/plain\r\nContent-Length: 9\r\n\r\n4",
    "/negative_length": OK + b"Content-Type: text/plain\r\nContent-Length: -1\r\n\r\n4",
    "/chunks": CHUNKED + 20 * (b"1000\r\n" + 4096 * b"x" + b"\r\n"),
    "/slow_chunks": CHUNKED + b"1\r\nx\r\n",
    "/bad_chunk": CHUNKED + b"zz\r\nx\r\n",
    "/continue": b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 103 x\r\nLink: </x>\r\n\r\n" + OK + b"Content-Length: 1\r\n\r\n4",
    "/continues": 5000 * b"HTTP/1.1 100 Continue\r\n\r\n",
    "/http10": b"HTTP/1.0 200 x\r\nContent-Type: text/plain\r\n\r\n4",
    "/http09": b'{"text": "4"}',
    "/bom": OK + b'Content-Type: application/json\r\nContent-Length: 16\r\n\r\n\xef\xbb\xbf{"text": "4"}',
}
CLOSED = {"/http10", "/http09"}


def response(status, body, kind="application/json", *headers):
    body = body if isinstance(body, bytes) else (body if isinstance(body, str) else json.dumps(body)).encode()
    lines = [f"HTTP/1.1 {status} x", f"Content-Type: {kind}", f"Content-Length: {len(body)}", *headers, "", ""]
    return "\r\n".join(lines).encode() + body


def closed(connection):
    """The client has closed its end: there is nothing to read but the end."""
    connection.settimeout(0.02)
    try:
        return connection.recv(1) == b""
    except (TimeoutError, ssl.SSLWantReadError):
        return False
    except OSError:
        return True
    finally:
        connection.settimeout(None)


def await_file(connection, file):
    while not has(file):
        if closed(connection):
            note("closed", "x")
            raise Reset
        time.sleep(0.02)


def answer(connection, count, method, path, headers, read_body):
    if method == "GET" and path == "/health":
        return response(500 if has("sick") else 200, "")
    if method == "GET" and path.startswith("/result/"):
        return response(200, {"text": "made", "state": 3}) if has("go") else response(
            202, {"text": "working", "state": 2}, "application/json", f"Location: {path}", "Retry-After: 1")
    if path == "/reset_before":
        note("heads", headers.get("idempotency-key"))
        raise Reset
    if path == "/second_unread" and count == 2:
        raise Reset
    if path == "/early":
        # Else the next call may be under way on this connection when it is closed: it would be lost.
        connection.sendall(response(409, "too early", "text/plain", "Connection: close"))
        raise Close
    if path == "/loop":
        read_body()
        return response(202, "", "text/plain", "Location: /loop")
    call = json.loads(read_body())
    note("posts", headers.get("idempotency-key"), call["attempt"], call["text"], headers.get("authorization", ""))
    if path == "/echo":
        return response(200, {"text": call["text"]})
    if path in RAW:
        connection.sendall(RAW[path])
        if path in CLOSED:
            raise Close
        return b""
    if path == "/plain_once" and count > 1:
        return response(200, call["text"], "text/plain; charset=utf-8")
    if path.startswith("/plain"):
        return response(200, call["text"], "text/plain; charset=utf-8", "Millrace-State: 5")
    if path == "/reset_after" or (path == "/second_dies" and count == 2):
        raise Reset
    if path in ("/second_dies", "/second_unread"):
        return response(200, {"text": call["text"]})
    if path in ("/half", "/cut"):
        connection.sendall(response(200, {"text": call["text"]})[:-5])
        raise Reset if path == "/half" else Close
    if path == "/slow":
        await_file(connection, "go")
        return response(200, {"text": call["text"]})
    if path == "/endless":
        connection.sendall(b"HTTP/1.1 200 x\r\nContent-Type: text/plain\r\n\r\n")
        while True:
            connection.sendall(b"x" * 4096)
    if path == "/trickle":
        connection.sendall(b"HTTP/1.1 200 x\r\nContent-Type: text/plain\r\n\r\n")
        while True:
            connection.sendall(b"x")
            time.sleep(0.05)
    if path == "/wrong":
        return response(200, '{"text": ')
    if path == "/500":
        return response(500, "no vacuum", "text/plain")
    if path.startswith("/busy"):
        later = email.utils.formatdate(time.time() + 2, usegmt=True) if path == "/busy_date" else "3"
        note("times", time.monotonic())
        return response(200, {"text": call["text"]}) if has("go") else response(
            503, "", "text/plain", f"Retry-After: {later}")
    if path == "/job":
        return response(202, {"text": "begun", "state": 2}, "application/json", f"Location: /result/{call['call']}")
    if path == "/moved":
        return response(307, "", "text/plain", "Location: http://127.0.0.1:9/elsewhere")
    return response(404, "")


def serve(connection):
    buffer = b""
    count = 0
    try:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if options.cert:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(options.cert, options.key)
            if options.client_ca:
                context.load_verify_locations(options.client_ca)
                context.verify_mode = ssl.CERT_REQUIRED
                # A client without a certificate learns it from the handshake, not later.
                context.maximum_version = ssl.TLSVersion.TLSv1_2
            connection = context.wrap_socket(connection, server_side=True)
        while True:
            while b"\r\n\r\n" not in buffer:
                got = connection.recv(65536)
                if not got:
                    return
                buffer += got
            head, _, buffer = buffer.partition(b"\r\n\r\n")
            first, *lines = head.decode("latin-1").split("\r\n")
            method, path, _ = first.split(" ")
            headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
            count += 1

            def read_body():
                nonlocal buffer
                length = int(headers.get("content-length", "0"))
                while len(buffer) < length:
                    got = connection.recv(65536)
                    if not got:
                        raise Reset
                    buffer += got
                body, buffer = buffer[:length], buffer[length:]
                return body

            connection.sendall(answer(connection, count, method, path, headers, read_body))
    except Reset:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    except (Close, OSError):
        pass
    finally:
        connection.close()


listener = socket.create_server(("127.0.0.1", options.port), backlog=128)
print("ready:", listener.getsockname()[1], flush=True)
while True:
    threading.Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()
