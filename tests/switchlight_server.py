# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A server on this machine that speaks SwitchLight's protocol as its documents tell it, with the failures that a test
asks for."""

import json
import threading
import time
from collections import Counter
from email import message_from_bytes, policy
from hashlib import sha256
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from tests import standin

KEY = "sk-Zoe-4711-do-not-tell"


class Service:
    """What it was asked, and what it charged. `plan` holds what happens to the next calls, in the order they come:
    'fine', 'truncated', 'garbage', 'cut', 'slow', 'hang', or (status, {header: value}, JSON); then all are fine.
    `charged` counts by picture the calls that were answered with status 200."""

    def __init__(self, plan=(), answer: bytes = b"", credits: float | None = 100.0, seconds: float = 0.0):
        self.plan, self.credits, self.seconds = list(plan), credits, seconds
        self.answer = answer or standin.png([[(200, 150, 120)] * 30] * 40)
        self.charged: Counter[str] = Counter()
        self.calls: list[dict] = []
        self.times: list[float] = []
        self.at_once = self.most_at_once = 0
        self.released = threading.Event()
        self._lock = threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/v1"
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.released.set()
        self._server.shutdown()
        self._server.server_close()

    def _handler(service):  # noqa: N805 - the handler has a self of its own
        class Handler(BaseHTTPRequestHandler):
            counted = False

            def do_GET(self):
                if self.path != "/v1/credits" or service.credits is None:
                    return self._json(404, {"message": "Not Found"})
                if self.headers["x-api-key"] != KEY:
                    return self._json(401, {"message": "Unauthorized. Check your API Key"})
                self._json(
                    200,
                    {"Credits": {"Free": service.credits, "Subscription": 0, "OneTime": 0, "Total": service.credits}},
                )

            def do_POST(self):
                with service._lock:
                    self.counted = True
                    service.at_once += 1
                    service.most_at_once = max(service.most_at_once, service.at_once)
                    service.times.append(time.monotonic())
                try:
                    self._albedo()
                except (BrokenPipeError, ConnectionResetError):
                    pass  # the client has gone
                finally:
                    self._end_call()

            def _end_call(self):
                """Before an answer's last bytes leave: once the client has them it begins its next call, and this
                thread may not have come further."""
                with service._lock:
                    service.at_once -= self.counted
                    self.counted = False

            def _albedo(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                parts = message_from_bytes(
                    f"Content-Type: {self.headers['Content-Type']}\r\n\r\n".encode() + body, policy=policy.HTTP
                )
                fields = {part.get_param("name", header="content-disposition"): part for part in parts.iter_parts()}
                if self.path != "/v1/acquire/albedo" or "source_image" not in fields:
                    return self._json(422, {"detail": [{"msg": "field required"}]})
                picture = fields["source_image"].get_payload(decode=True)
                with service._lock:
                    source = fields["source_image"]
                    others = {name: part.get_payload() for name, part in fields.items() if name != "source_image"}
                    service.calls.append(
                        {
                            "path": self.path,
                            "key": self.headers["x-api-key"],
                            "picture": picture,
                            "agent": self.headers["User-Agent"],
                            "file": source.get_filename(),
                            "type": source.get_content_type(),
                            **others,
                        }
                    )
                    what = service.plan.pop(0) if service.plan else "fine"
                time.sleep(service.seconds)
                if isinstance(what, tuple):
                    return self._json(what[0], what[2], what[1])
                if what == "hang":
                    return service.released.wait(20)
                if self.headers["x-api-key"] != KEY:
                    return self._json(401, {"message": "Unauthorized. Check your API Key"})
                service.charged[sha256(picture).hexdigest()] += 1
                self._picture(what)

            def _picture(self, what: str):
                data = {
                    "garbage": b"<html>so sorry</html>",
                    "truncated": service.answer[: len(service.answer) // 2],
                }.get(what, service.answer)
                self.send_response(200)
                self.send_header("Content-Type", "image/png")
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                if what == "slow":
                    for i in range(len(data)):
                        self.wfile.write(data[i : i + 1])
                        if service.released.wait(0.05):
                            return
                self._end_call()
                self.wfile.write(data[: len(data) // 2] if what == "cut" else data)

            def _json(self, status: int, value, headers=()):
                data = json.dumps(value).encode()
                self.send_response(status)
                for name, text in dict(headers).items():
                    self.send_header(name, text)
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self._end_call()
                self.wfile.write(data)

            def log_message(self, *_):
                pass

        return Handler
