"""Faults and truth from outside the emulator's process: JSON lines over a Unix socket.

Requests: ``{"fault": name, "after_s": 0, "for_s": 0}`` (for 0 s: until cleared),
``{"do": "clear"}``, ``{"get": "motion", "since_s": t}``. Answers: ``{"done": true}``,
``{"motion": [[t_s, q..., qd...], ...]}`` or ``{"error": text}``.
"""

import contextlib
import json
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sim_backend.loopback_grbl.faults import fault_names
from sim_backend.loopback_grbl.machine import FloatArray
from sim_backend.loopback_grbl.server import LoopbackGantry

_LONGEST_S = 3600.0


def socket_path(port: Path) -> Path:
    """Where the control socket of the gantry linked at ``port`` is."""
    return port.with_name(port.name + ".control")


class ControlServer:
    """Answers requests about one gantry until closed."""

    def __init__(self, gantry: LoopbackGantry, path: Path) -> None:
        self._gantry = gantry
        self._path = path
        self._timers: list[threading.Timer] = []
        self._active: set[str] = set()
        path.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.bind(str(path))
        self._socket.listen()
        threading.Thread(target=self._accept, name="grbl-control", daemon=True).start()

    def close(self) -> None:
        """Stop answering and forget faults still to come."""
        for timer in self._timers:
            timer.cancel()
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return  # closed
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection, connection.makefile("rw", encoding="utf-8") as file:
            for line in file:
                file.write(json.dumps(self._answer(line)) + "\n")
                file.flush()

    def _answer(self, line: str) -> dict[str, Any]:
        try:
            request = json.loads(line)
            if "fault" in request:
                return self._order(request)
            if request.get("do") == "clear":
                for name in list(self._active):
                    self._clear(name)
                return {"done": True}
            if request.get("get") == "motion":
                return {"motion": self._gantry.motion(float(request["since_s"])).tolist()}
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            return {"error": f"malformed request: {error}"}
        return {"error": "unknown request; known: fault, do clear, get motion"}

    def _order(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["fault"]
        known = (*fault_names(), "drop")
        if name not in known:
            return {"error": f"no fault {name!r}; known: {', '.join(known)}"}
        after_s = min(max(float(request.get("after_s", 0.0)), 0.0), _LONGEST_S)
        for_s = min(max(float(request.get("for_s", 0.0)), 0.0), _LONGEST_S)
        self._later(after_s, lambda: self._begin(name))
        if for_s > 0.0:
            self._later(after_s + for_s, lambda: self._clear(name))
        return {"done": True}

    def _later(self, delay_s: float, action: Callable[[], None]) -> None:
        if delay_s <= 0.0:
            action()
            return
        timer = threading.Timer(delay_s, action)
        timer.daemon = True
        self._timers.append(timer)
        timer.start()

    def _begin(self, name: str) -> None:
        self._active.add(name)
        self._gantry.inject(name)

    def _clear(self, name: str) -> None:
        self._active.discard(name)
        self._gantry.clear(name)


class ControlClient:
    """The other end, for commands and tests; raises OSError where no gantry listens."""

    def __init__(self, port: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(5.0)
        self._socket.connect(str(socket_path(port)))
        self._file = self._socket.makefile("rw", encoding="utf-8")

    def fault(self, name: str, after_s: float = 0.0, for_s: float = 0.0) -> None:
        """Order a fault; raises ValueError, naming the known ones, for an unknown one."""
        self._ask({"fault": name, "after_s": after_s, "for_s": for_s})

    def clear(self) -> None:
        """End the causes of all faults under way."""
        self._ask({"do": "clear"})

    def motion(self, since_s: float) -> FloatArray:
        """Rows (t_s, q (6), qd (6)) of the true motion since ``since_s``."""
        return np.array(self._ask({"get": "motion", "since_s": since_s})["motion"], dtype=float)

    def close(self) -> None:
        """Hang up."""
        self._file.close()
        self._socket.close()

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        self._file.write(json.dumps(request) + "\n")
        self._file.flush()
        reply: dict[str, Any] = json.loads(self._file.readline())
        if "error" in reply:
            raise ValueError(reply["error"])
        return reply
