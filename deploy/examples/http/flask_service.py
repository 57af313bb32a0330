"""A service over HTTP with Flask: answers a number with its square root.

    python3 flask_service.py [PORT]
"""
import math
import sys

from flask import Flask, request

app = Flask(__name__)


@app.post("/")
def root():
    text = request.json["text"]
    try:
        return {"text": f"{math.sqrt(float(text)):.6f}", "state": 1}
    except ValueError:
        return {"text": f"ERROR: no root of '{text}'", "state": 99}


app.run("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 8000)
