#!/usr/bin/env python3
"""An HTTP proxy for tests: `proxy.py FOLDER [--port N]`.

Prints "ready: PORT". Each request is a line of FOLDER/proxied: its method and target. While FOLDER/refuse exists, each gets
the status that stands there.
"""
import argparse
import http.client
import http.server
import pathlib
import socket
import threading
import urllib.parse

parser = argparse.ArgumentParser()
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--port", type=int, default=0)
options = parser.parse_args()


class Proxy(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def parse_request(self):
        if not super().parse_request():
            return False
        with open(options.folder / "proxied", "a", encoding="utf-8") as out:
            out.write(f"{self.command} {self.path}\n")
        if (options.folder / "refuse").exists():
            self.answer(int((options.folder / "refuse").read_text()), {"Content-Type": "text/plain"}, b"no way")
            self.close_connection = True
            return False
        return True

    def answer(self, status, headers, body):
        self.send_response(status)
        for name, value in {**headers, "Content-Length": len(body)}.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        target = urllib.parse.urlsplit(self.path)
        server = http.client.HTTPConnection(target.netloc)
        server.request("POST", target.path, self.rfile.read(int(self.headers["Content-Length"])), dict(self.headers))
        got = server.getresponse()
        self.answer(got.status, {"Content-Type": got.headers["Content-Type"]}, got.read())
        server.close()

    def do_CONNECT(self):
        host, port = self.path.rsplit(":", 1)
        server = socket.create_connection((host, int(port)))
        self.send_response(200)
        self.end_headers()

        def pump(source, sink):
            while block := source.recv(65536):
                sink.sendall(block)
            sink.shutdown(socket.SHUT_WR)

        back = threading.Thread(target=pump, args=(server, self.connection), daemon=True)
        back.start()
        pump(self.connection, server)
        back.join()
        self.close_connection = True


listener = http.server.ThreadingHTTPServer(("127.0.0.1", options.port), Proxy)
print("ready:", listener.server_address[1], flush=True)
listener.serve_forever()
