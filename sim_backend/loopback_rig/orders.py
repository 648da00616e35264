"""Faults on demand from another process: JSON lines over TCP, one answer a line.

Requests: ``{"fault": name, "after_s": 0, "for_s": 0}`` (for 0 s: until cleared) and
``{"do": "clear"}``. Answers: ``{"done": true}`` or ``{"error": text}``.
"""

import json
import socket
import socketserver
import threading
from typing import Any, Protocol

ORDER_PORT = 29989


class Faulty(Protocol):
    """Something that fails when told to."""

    def fault(self, name: str, after_s: float, for_s: float) -> None:
        """Order a fault; raises ValueError for one that is not known."""
        ...

    def clear(self) -> None:
        """End all faults."""
        ...


class OrderServer:
    """Passes orders on to ``faulty`` until closed; raises OSError when the port is taken."""

    def __init__(self, host: str, faulty: Faulty, port: int = ORDER_PORT) -> None:
        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                for line in self.rfile:
                    self.wfile.write(json.dumps(_answer(faulty, line)).encode() + b"\n")

        socketserver.ThreadingTCPServer.allow_reuse_address = True
        self._server = socketserver.ThreadingTCPServer((host, port), Handler)
        self._server.daemon_threads = True
        self.port = int(self._server.server_address[1])
        threading.Thread(target=self._server.serve_forever, name="orders", daemon=True).start()

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()


def order(host: str, request: dict[str, Any], port: int = ORDER_PORT) -> None:
    """Send one order; raises OSError where nobody listens, ValueError when it is refused."""
    with (
        socket.create_connection((host, port), timeout=5.0) as connection,
        connection.makefile("rw", encoding="utf-8") as file,
    ):
        file.write(json.dumps(request) + "\n")
        file.flush()
        answer = json.loads(file.readline() or '{"error": "the emulated rig hung up"}')
    if "error" in answer:
        raise ValueError(answer["error"])


def _answer(faulty: Faulty, line: bytes) -> dict[str, Any]:
    try:
        request = json.loads(line)
        if "fault" in request:
            after_s, for_s = (float(request.get(key, 0.0)) for key in ("after_s", "for_s"))
            faulty.fault(str(request["fault"]), after_s, for_s)
            return {"done": True}
        if request.get("do") == "clear":
            faulty.clear()
            return {"done": True}
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        return {"error": str(error)}
    return {"error": "unknown order; known: fault, do clear"}
