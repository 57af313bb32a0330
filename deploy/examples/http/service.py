"""A service over HTTP with Python alone: answers a number with its square root.

    python3 service.py [PORT]
"""
import json
import math
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


def answer(call):
    try:
        return {"text": f"{math.sqrt(float(call['text'])):.6f}", "state": 1}
    except ValueError:
        return {"text": f"ERROR: no root of '{call['text']}'", "state": 99}


class Service(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"  # keeps connections

    def do_POST(self):
        call = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        body = json.dumps(answer(call)).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


ThreadingHTTPServer(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 8000), Service).serve_forever()
